"""What the closed grammar can hear: `driving.gram`, in JSGF. Edit it there; nothing else lists these words."""
