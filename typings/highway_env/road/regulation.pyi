from highway_env.road.road import Road

class RegulatedRoad(Road):
    REGULATION_FREQUENCY: int
    steps: int
    def enforce_road_rules(self) -> None: ...
