"""Array layout of a road and its traffic. Row 0 is the ego, then the other vehicles in spawn order, then the objects.

The rows equal the ids of an observation. `order` lists all solid rows by their position along the road; it is only
kept on highways, whose lanes are all parallel to +x.
"""

from __future__ import annotations

from typing import Final

# Entities, floats.
X: Final = 0
Y: Final = 1
HEADING: Final = 2
SPEED: Final = 3
TARGET_SPEED: Final = 4
EXPONENT: Final = 5  # IDM's delta of this driver
TIMER: Final = 6  # since the last look for a lane change
STEERING: Final = 7  # action in force
ACCELERATION: Final = 8
PUSH_X: Final = 9  # displacement owed to a collision
PUSH_Y: Final = 10
LATERAL_SPEED: Final = 11  # dynamic bicycle
YAW_RATE: Final = 12
LENGTH: Final = 13
WIDTH: Final = 14
ENTITY_FLOATS: Final = 15

# Entities, integers.
KIND: Final = 0
LANE: Final = 1
TARGET_LANE: Final = 2
CRASHED: Final = 3
PUSHED: Final = 4
YIELDING: Final = 5
ROUTE_AT: Final = 6  # first leg not yet dropped
ROUTE_END: Final = 7
ROUTE: Final = 8  # up to ROUTE_LEGS road numbers
ROUTE_LEGS: Final = 6
ENTITY_INTS: Final = ROUTE + ROUTE_LEGS

TRAFFIC: Final = 0  # values of KIND
EGO_KIND: Final = 1
OBSTACLE: Final = 2
SIGN: Final = 3

# Lanes, floats.
START_X: Final = 0
START_Y: Final = 1
DIRECTION_X: Final = 2
DIRECTION_Y: Final = 3
LANE_HEADING: Final = 4
LANE_LENGTH: Final = 5
LANE_WIDTH: Final = 6
LIMIT: Final = 7
AMPLITUDE: Final = 8
PULSATION: Final = 9
PHASE: Final = 10
RADIUS: Final = 11
START_PHASE: Final = 12
TURN_SIGN: Final = 13
LANE_FLOATS: Final = 14

# Lanes, integers.
SHAPE: Final = 0
ROAD: Final = 1
INDEX: Final = 2
FORBIDDEN: Final = 3
PRIORITY: Final = 4
LANE_INTS: Final = 5

STRAIGHT: Final = 0  # values of SHAPE
SINE: Final = 1
ARC: Final = 2

# Roads (all lanes between two nodes), integers.
FROM: Final = 0
TO: Final = 1
FIRST: Final = 2
COUNT: Final = 3
EXITS: Final = 4  # number of roads that go on from here
EXIT: Final = 5  # up to MAX_EXITS road numbers, in order of insertion
MAX_EXITS: Final = 4
ROAD_INTS: Final = EXIT + MAX_EXITS

# The scene, integers.
VEHICLES: Final = 0
ENTITIES: Final = 1
SOLID: Final = 2  # length of `order`
PARALLEL: Final = 3  # 1 where `order` is kept
REGULATED: Final = 4
TICKS: Final = 5
DYNAMIC_EGO: Final = 6
EGO_PRESENT: Final = 7
SCENE_INTS: Final = 8

# What a step reports.
OUT_CRASHED: Final = 0
OUT_ON_ROAD: Final = 1  # 1 on the road, 0 off it, -1 off it beyond the end of the lane
OUT_LANE: Final = 2
OUT_FRONT: Final = 3  # row of the vehicle or obstacle ahead in the ego's lane, -1 for none
OUT_GAP: Final = 4
OUT_TTC_ALONG: Final = 5
OUT_TTC_PLANE: Final = 6
OUT_TTC_LANE: Final = 7
OUT_STEERING: Final = 8
OUT_ACCELERATION: Final = 9
OUT_FLOATS: Final = 10

DT_S: Final = 0.1
CAR_M: Final = 5.0  # highway-env's length of a vehicle where a lane asks for one
