"""Pictures of what a world shows, from cameras on the vehicle, in any weather, with ground truth. Not photoreal."""

from chauffeur.camera.look import LOOKS, CameraLook, look_of
from chauffeur.camera.pictures import CameraImages, ImageTruth
from chauffeur.camera.renderer import Renderer
from chauffeur.camera.renderer_choice import make_renderer
from chauffeur.camera.rig import RIGS, Camera, Rig, front_rig, nuplan_rig, nuscenes_rig, rig_of
from chauffeur.camera.solids import SemanticClass
from chauffeur.camera.weather import Conditions

__all__ = [
    "LOOKS",
    "RIGS",
    "Camera",
    "CameraImages",
    "CameraLook",
    "Conditions",
    "ImageTruth",
    "Renderer",
    "Rig",
    "SemanticClass",
    "front_rig",
    "look_of",
    "make_renderer",
    "nuplan_rig",
    "nuscenes_rig",
    "rig_of",
]
