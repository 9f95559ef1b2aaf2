"""Driving in real time: control, policy and planner in processes of their own, joined by memory nobody waits for.

control   owns the actuator, the driver, the shield and the fallbacks; runs at a fixed rate, whatever happens elsewhere
policy    checks plans, runs the program that is driven, and says what it wishes
planner   turns words into plans: models, networks and memory live here and nowhere else
The process that starts them (`supervisor`) restarts what dies, and keeps the books.
"""
