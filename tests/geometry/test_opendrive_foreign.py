"""OpenDRIVE files as other tools and people write them: read right, or what is not is named."""

from __future__ import annotations

import math
import re
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chauffeur.geometry.opendrive import OpenDriveError, OpenDriveMap, parse_opendrive, read_opendrive

WIDTH = '<width sOffset="0" a="3.5" b="0" c="0" d="0"/>'
BROKEN = '<roadMark sOffset="0" type="broken" laneChange="both"/>'


def lane(number: int, inside: str = WIDTH + BROKEN, *, kind: str = "driving", more: str = "") -> str:
    return f'<lane id="{number}" type="{kind}" level="false"{more}>{inside}</lane>'


def section(*lanes: str, at: float = 0.0, more: str = "", side: str = "right") -> str:
    centre = '<center><lane id="0" type="none"/></center>'
    return f'<laneSection s="{at}"{more}>{centre}<{side}>{"".join(lanes)}</{side}></laneSection>'


def border(at_m: float) -> str:
    return f'<border sOffset="0" a="{at_m}" b="0" c="0" d="0"/>'


def town(limit: float, at_m: float = 0.0) -> str:
    """The type of a road from a station on, with its limit in km/h."""
    return f'<type s="{at_m}"><speed max="{limit}" unit="km/h"/></type>'


def mark(kind: str, at_m: object = 0, more: str = "") -> str:
    return f'<roadMark sOffset="{at_m}" type="{kind}"{more}/>'


def speed(limit: float, at_m: float, unit: str = "km/h") -> str:
    return f'<speed sOffset="{at_m}" max="{limit}" unit="{unit}"/>'


def road(
    sections: str = "",
    *,
    length: str = "200",
    shape: str = "<line/>",
    extra: str = town(50),
    name: str = "1",
    attributes: str = 'junction="-1"',
    x: str = "0",
    after: str = "",
) -> str:
    sections = sections or section(lane(-1), lane(-2))
    return (
        f'<road id="{name}" length="{length}" {attributes}>{extra}<planView>'
        f'<geometry s="0" x="{x}" y="0" hdg="0" length="{length}">{shape}</geometry></planView>'
        f"<lanes>{sections}</lanes>{after}</road>"
    )


def read(*roads: str, header: str = '<header revMajor="1" revMinor="6"/>', more: str = "") -> OpenDriveMap:
    return parse_opendrive(f"<OpenDRIVE>{header}{''.join(roads or (road(),))}{more}</OpenDRIVE>")


def limits(town: OpenDriveMap, number: int = -1) -> list[tuple[float, float]]:
    """(length, limit in km/h) of each piece of a lane of road 1."""
    pieces = [one for one in town.road.lanes if re.fullmatch(rf"1:[\d.]+:{number}", one.id)]
    return [(round(one.length_m, 1), round(one.speed_limit_mps * 3.6, 1)) for one in pieces]


def changes(town: OpenDriveMap, number: int = -1) -> list[tuple[float, bool]]:
    """(length, whether one changes to the right) of each piece of a lane of road 1."""
    pieces = [one for one in town.road.lanes if re.fullmatch(rf"1:[\d.]+:{number}", one.id)]
    return [(round(one.length_m, 1), bool(town.road.changes(one.id))) for one in pieces]


# From the field -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["xodr-empty-link", "xodr-lane-border", "xodr-sign-value-text"])
def test_odd_files_from_the_field_are_read(case: str, case_folder: Callable[[str], Path]) -> None:
    for path in sorted(case_folder(case).glob("*.xodr")):
        town = read_opendrive(path)
        assert [(one.id, one.width_m, round(one.speed_limit_mps * 3.6), round(one.centre.points_m[0][1], 2))
                for one in town.road.lanes if one.road.startswith("1:")] == [
            ("1:0:-1", 3.5, 50, -1.75), ("1:0:-2", 3.5, 50, -5.25),
        ]  # fmt: skip


def test_a_marking_from_the_field_that_becomes_solid(case_folder: Callable[[str], Path]) -> None:
    town = read_opendrive(case_folder("xodr-mark-becomes-solid") / "map.xodr")
    assert changes(town) == changes(town, -2) == [(20.0, True), (180.0, False)]


# Where lanes lie ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lanes", "middles"),
    [
        (section(lane(-1, border(-3)), lane(-2, border(-7))), [-1.5, -5.0]),
        (section(lane(-1), lane(-2, border(-7.5))), [-1.75, -5.5]),
        (section(lane(-1, WIDTH + border(-9)), lane(-2)), [-1.75, -5.25]),
        (section(lane(1, border(3)), lane(2, border(7)), side="left"), [1.5, 5.0]),
        ('<laneOffset s="0" a="2" b="0" c="0" d="0"/>' + section(lane(-1, border(-3))), [0.5]),
        (section(lane(-1, kind="none"), lane(-2)), [-5.25]),
    ],
)  # fmt: skip
def test_borders_and_widths_say_where_lanes_lie(lanes: str, middles: list[float]) -> None:
    assert [round(one.centre.points_m[0][1], 3) for one in read(road(lanes)).road.lanes] == middles


def test_a_border_that_moves_is_followed() -> None:
    town = read(road(section(lane(-1, '<border sOffset="0" a="-3" b="-0.01" c="0" d="0"/>'))))
    assert town.road["1:0:-1"].width_m == pytest.approx(4.0, abs=0.01)
    assert town.road["1:0:-1"].centre.points_m[-1][1] == pytest.approx(-2.5, abs=0.01)


def test_a_section_of_one_side_leaves_the_other_as_it_is() -> None:
    both = '<laneSection s="0"><left>' + lane(1) + "</left><right>" + lane(-1) + "</right></laneSection>"
    right = section(lane(-1, '<link><predecessor id="-1"/></link>' + WIDTH), at=80.0, more=' singleSide="true"')
    town = read(road(both + right))
    assert town.road["1:1:1"].length_m == pytest.approx(120.0)
    assert town.road["1:1:1"].successors == ("1:0:1",), "driven against the reference line"
    assert town.road["1:0:-1"].successors in ((), ("1:1:-1",))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (road(shape="<clothoid/>"), "clothoid"),
        (road(shape="<line/><bend/>"), "bend"),
        (road(shape='<paramPoly3 pRange="chord" aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0"/>'), "pRange"),
        (road(section(lane(-1, '<shape sOffset="0"/>' + WIDTH))), "shape"),
        (road(section(lane(-1, BROKEN))), "neither a <width> nor a <border>"),
        (road(section(lane(-1, BROKEN, kind="median"), lane(-2))), "neither a <width> nor a <border>"),
        (road(section(lane(-1)) + "<laneGroup/>"), "laneGroup"),
        (road('<laneSection s="0"><middle/><right>' + lane(-1) + "</right></laneSection>"), "middle"),
        (road(section(lane(-1, '<width sOffset="0" a="wide" b="0" c="0" d="0"/>'))), "a='wide'"),
        (road(section(lane(1))), "lanes \\[1\\] on its right"),
        (road(section(lane(-1), lane(-1))), "on its right"),
        (road(section(lane(-1, more=' direction="reversed"'))), "reversed"),
        (road(attributes='rule="MHT"'), "MHT"),
        (road() + road(), "Two roads"),
        (road(extra='<include file="other.xodr"/>'), "include"),
        (road(length="200").replace('hdg="0" length="200"', 'hdg="0" length="50"'), "50 m long"),
    ],
)
def test_geometry_that_is_not_known_is_refused_by_name(text: str, says: str) -> None:
    with pytest.raises(OpenDriveError, match=says):
        read(text)


@pytest.mark.parametrize("kind", ["arcLength", "arclength", "normalized", "Normalized"])
def test_both_ranges_of_a_cubic_are_read(kind: str) -> None:
    scale = 1.0 if "orm" not in kind else 200.0
    cubic = f'<paramPoly3 pRange="{kind}" aU="0" bU="{scale}" cU="0" dU="0" aV="0" bV="0" cV="0" dV="0"/>'
    assert read(road(shape=cubic)).road["1:0:-1"].centre.points_m[-1][0] == pytest.approx(200.0)


@pytest.mark.parametrize(
    ("header", "fine"),
    [('<header revMajor="1" revMinor="4"/>', True), ("<header/>", True), ("", True),
     ('<header revMajor="2" revMinor="0"/>', False), ('<header revMajor="1" revMinor="9"/>', True)],
)  # fmt: skip
def test_other_versions_are_recognised(header: str, fine: bool) -> None:
    if not fine:
        with pytest.raises(OpenDriveError, match="OpenDRIVE '2'"):
            read(header=header)
        return
    town = read(header=header)
    assert bool(town.remarks) == ("9" in header)


# Rules along a lane ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("extra", "speeds", "found"),
    [
        (town(50) + town(30, 120), "", [(120.0, 50.0), (80.0, 30.0)]),
        (town(50), speed(30, 60), [(60.0, 50.0), (140.0, 30.0)]),
        (town(50), speed(70, 0) + speed(20, 150, "mph"), [(150.0, 70.0), (50.0, 32.2)]),
        (town(50), speed(50, 60), [(200.0, 50.0)]),
        (town(30, 120) + town(50), "", [(120.0, 50.0), (80.0, 30.0)]),
        (town(50) + town(30, 199.9), "", [(200.0, 50.0)]),
        (town(50) + town(30, 0.1), "", [(200.0, 30.0)]),
        (
            town(50) + town(30, 60) + town(20, 100),
            speed(10, 80),
            [(60.0, 50.0), (20.0, 30.0), (20.0, 10.0), (100.0, 10.0)],
        ),
    ],
)
def test_a_limit_inside_a_road_holds_from_there(extra: str, speeds: str, found: list[tuple[float, float]]) -> None:
    town = read(road(section(lane(-1, WIDTH + BROKEN + speeds), lane(-2)), extra=extra))
    assert limits(town) == found
    for one in town.road.lanes[:-1]:
        assert one.id.endswith("-2") or one.successors or one.length_m < 200.1


@pytest.mark.parametrize(
    ("marks", "found"),
    [
        (BROKEN, [(200.0, True)]),
        (BROKEN + mark("solid", 20, ' laneChange="none"'), [(20.0, True), (180.0, False)]),
        (mark("solid", 20) + BROKEN, [(20.0, True), (180.0, False)]),
        (mark("solid") + mark("broken", 50) + mark("solid", 90), [(50.0, False), (40.0, True), (110.0, False)]),
        (mark("broken", 30), [(30.0, False), (170.0, True)]),
        (mark("solid broken"), [(200.0, False)]),
        (mark("edge"), [(200.0, False)]),
        (mark("broken", more=' laneChange="Both"'), [(200.0, True)]),
        (mark("broken", more=' laneChange="perhaps"'), [(200.0, False)]),
        (mark("broken", "here"), [(200.0, False)]),
        ("", [(200.0, False)]),
    ],
)
def test_lanes_are_changed_only_where_the_marking_lets_one(marks: str, found: list[tuple[float, bool]]) -> None:
    assert changes(read(road(section(lane(-1, WIDTH + marks), lane(-2))))) == found


def test_the_pieces_of_a_lane_lead_into_each_other() -> None:
    link = '<link><predecessor id="-1"/><successor id="-1"/></link>'
    marks = BROKEN + mark("solid", 20) + mark("broken", 150)
    onto, back = (
        f'elementType="road" elementId="{name}" contactPoint="{end}"' for name, end in ((2, "start"), (1, "end"))
    )
    first = road(section(lane(-1, link + WIDTH + marks), lane(-2)), extra=f"<link><successor {onto}/></link>")
    second = road(section(lane(-1, link + WIDTH)), name="2", x="200", extra=f"<link><predecessor {back}/></link>")
    town = read(first, second)
    way, found = "1:0:-1", ["1:0:-1"]
    while town.road[way].successors:
        (way,) = town.road[way].successors
        found.append(way)
    assert found == ["1:0:-1", "1:0.1:-1", "1:0.2:-1", "2:0:-1"]
    assert town.road_station("1:0.1:-1", 30.0) == pytest.approx(50.0)


# Odd records ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit", "kmh"),
    [
        ("50", "kmh", 50.0), ("50", "kph", 50.0), ("50", "KM/H", 50.0), ("50", " km/h ", 50.0), ("50 km/h", "", 50.0),
        ("30", "MPH", 48.3), ("30mph", "", 48.3), ("13.89", "", 50.0), ("13.89", "m/s", 50.0), ("60", "", 60.0),
        ("5e1", "km/h", 50.0),
    ],
)  # fmt: skip
def test_speeds_are_read_in_every_spelling(text: str, unit: str, kmh: float) -> None:
    town = read(road(extra=f'<type s="0"><speed max="{text}" unit="{unit}"/></type>'))
    assert limits(town)[0][1] == pytest.approx(kmh, abs=0.1)
    assert not town.remarks


@pytest.mark.parametrize(
    ("text", "unit"),
    [("50", "knots"), ("fast", "km/h"), ("-50", "km/h"), ("nan", "km/h"), ("1e9", "km/h"), ("5,5", "m/s"), ("inf", "")],
)
def test_a_speed_that_is_none_costs_itself_and_is_named(text: str, unit: str) -> None:
    second = road(name="2", x="300", extra='<type s="0"><speed max="30" unit="km/h"/></type>')
    town = read(road(extra=f'<type s="0"><speed max="{text}" unit="{unit}"/></type>'), second)
    assert limits(town) == [(200.0, 50.0)], "as where none is written"
    assert round(town.road["2:0:-1"].speed_limit_mps * 3.6) == 30
    assert len(town.remarks) == 1 and "road '1'" in town.remarks[0]


SIGNAL = '<signal s="50" t="-8" id="{id}" dynamic="no" orientation="+" type="274" subtype="-1" {more}/>'


@pytest.mark.parametrize("value", ["none", "-", "50 km/h", "nan", "1e400", "fünfzig"])
def test_a_sign_of_an_odd_value_costs_the_value(value: str) -> None:
    odd, fine = SIGNAL.format(id=1, more=f'value="{value}"'), SIGNAL.format(id=2, more='value="30" unit="km/h"')
    town = read(road(after=f"<signals>{odd}{fine}</signals>"))
    assert [(one.id, one.value) for one in town.signals] == [("1", None), ("2", 30.0)]
    assert [one.speed_mps for one in town.signals] == [None, pytest.approx(30.0 / 3.6)]
    assert any("signal '1'" in one for one in town.remarks)


@pytest.mark.parametrize(
    ("after", "kept"),
    [
        ('<signals><signal s="x" t="0" id="1"/><signal s="1" t="0" id="2"/></signals>', ["2"]),
        ('<signals><signal id="1"/><signal s="1" t="0" id="2"/></signals>', ["2"]),
        ('<signals><signal s="1" t="0" id="2"><validity fromLane="a" toLane="-1"/></signal></signals>', ["2"]),
        ('<signals><signal s="1e12" t="0" id="1"/><signal s="1" t="0" id="2"/></signals>', ["2"]),
    ],
)
def test_an_odd_signal_costs_itself(after: str, kept: list[str]) -> None:
    town = read(road(after=after))
    assert [one.id for one in town.signals] == kept and town.remarks


def test_an_odd_object_costs_itself() -> None:
    town = read(road(after='<objects><object id="1" s="?" t="0"/><object id="2" s="1" t="0"/></objects>'))
    assert [one.id for one in town.objects] == ["2"] and "object '1'" in town.remarks[0]


@pytest.mark.parametrize(
    "link",
    ["<predecessor/>", '<predecessor id=""/>', '<predecessor id="none"/>', '<predecessor id="1.5"/>', "<other/>"],
)
def test_an_odd_lane_link_costs_itself(link: str) -> None:
    town = read(road(section(lane(-1, f"<link>{link}</link>" + WIDTH), lane(-2))))
    assert len(town.road.lanes) == 2


@pytest.mark.parametrize(
    "link",
    [
        "<successor/>",
        '<successor elementType="road" elementId="2"/>',
        '<successor elementType="road" elementId="2" elementS="30" elementDir="+"/>',
        '<successor elementType="river" elementId="2" contactPoint="start"/>',
        '<successor elementType="road" elementId="99" contactPoint="start"/>',
    ],
)
def test_a_road_link_that_leads_to_no_end_leads_nowhere(link: str) -> None:
    inside = '<link><successor id="-1"/></link>' + WIDTH
    town = read(road(section(lane(-1, inside)), extra=f"<link>{link}</link>"), road(name="2", x="200"))
    assert town.road["1:0:-1"].successors == ()


def test_unknown_lane_types_are_named() -> None:
    town = read(road(section(lane(-1, kind="Driving"), lane(-2, kind="hoverlane"), lane(-3, kind="tram"))))
    assert [one.id for one in town.road.lanes] == ["1:0:-1"]
    assert any("'hoverlane'" in one for one in town.remarks) and any("ails are left out" in one for one in town.remarks)


def test_many_of_one_kind_are_one_remark() -> None:
    signals = "".join(SIGNAL.format(id=i, more='value="none"') for i in range(50))
    town = read(road(after=f"<signals>{signals}</signals>"))
    assert len(town.remarks) == 1 and "47 more" in town.remarks[0] and len(town.remarks[0]) < 300


# Junctions ------------------------------------------------------------------------------------------------------------


def fork(kind: str, connection: str) -> OpenDriveMap:
    inside = '<link><predecessor id="-1"/><successor id="-1"/></link>' + WIDTH
    end = '<link><successor elementType="junction" elementId="7"/></link>'
    start = '<link><predecessor elementType="junction" elementId="7"/></link>'
    first = road(section(lane(-1, inside)), extra=end)
    second = road(section(lane(-1, inside)), name="2", x="200", extra=start)
    return read(first, second, more=f'<junction id="7" type="{kind}">{connection}</junction>')


LINK = '<laneLink from="-1" to="-1"/>'


@pytest.mark.parametrize(
    "roads",
    ['incomingRoad="1" linkedRoad="2" contactPoint="start"', 'incomingRoad="2" linkedRoad="1" contactPoint="end"'],
)
def test_a_direct_junction_leads_on(roads: str) -> None:
    found = fork("direct", f'<connection id="0" {roads}>{LINK}</connection>')
    assert found.road["1:0:-1"].successors == ("2:0:-1",)


WAY = 'incomingRoad="1" connectingRoad="2" contactPoint="start"'


def test_a_virtual_junction_is_named() -> None:
    found = fork("virtual", f'<connection id="0" {WAY}>{LINK}</connection>')
    assert found.road["1:0:-1"].successors == () and "irtual" in found.remarks[0]


def test_an_odd_connection_costs_itself() -> None:
    odd = '<connection id="0" incomingRoad="1" connectingRoad="77"/>'
    found = fork("default", f'{odd}<connection id="1" {WAY}><laneLink from="a" to="-1"/>{LINK}</connection>')
    assert found.road["1:0:-1"].successors == ("2:0:-1",) and len(found.remarks) == 2


def test_lane_links_that_a_connection_leaves_out_are_those_of_its_lanes() -> None:
    town = fork("default", '<connection id="1" incomingRoad="1" connectingRoad="2" contactPoint="start"/>')
    assert town.road["1:0:-1"].successors == ("2:0:-1",)


def test_left_hand_traffic_is_read() -> None:
    town = read(road(attributes='rule="LHT" junction="-1"'))
    assert town.road["1:0:-1"].centre.points_m[0][0] == pytest.approx(200.0), "against the reference line"


# Sense ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        road(length="1e8"),
        road(length="nan"),
        road(length="-5"),
        road(length="inf"),
        road(x="1e300"),
        road(shape='<arc curvature="1e9"/>'),
        road(shape='<spiral curvStart="0" curvEnd="inf"/>'),
        road(section(lane(-1, '<width sOffset="0" a="1e8" b="0" c="0" d="0"/>'))),
        road(section(lane(-1, '<width sOffset="0" a="3" b="0" c="0" d="1e6"/>'))),
        road(section(lane(-1, '<width sOffset="0" a="nan" b="0" c="0" d="0"/>'))),
        road(section(lane(-1e9))),  # type: ignore[arg-type]
        road(section(lane(-1), at=1e9)),
        road(shape='<paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="0" dV="1e7"/>'),
        "".join(road(name=str(i), length="1e5", sections=section(*(lane(-k) for k in range(1, 40)))) for i in range(9)),
    ],
)
def test_numbers_without_sense_are_refused_before_they_take_memory(text: str) -> None:
    tracemalloc.start()
    try:
        with pytest.raises(OpenDriveError):
            read(text)
        assert tracemalloc.get_traced_memory()[1] < 100e6
    finally:
        tracemalloc.stop()


def test_a_road_of_a_motorway_is_read() -> None:
    town = read(road(length="20000"))
    assert town.road["1:0:-1"].length_m == pytest.approx(20_000.0)


_ATTRIBUTE = re.compile(r'(\w+)="([^"]*)"')


@given(st.data())
def test_any_odd_attribute_is_read_or_refused_in_words(data: st.DataObject) -> None:
    """Whatever one attribute becomes, lanes have sane places, or the file is refused by the reader's own error."""
    link = '<link><predecessor id="-1"/><successor id="-1"/></link>'
    whole = (
        '<OpenDRIVE><header revMajor="1" revMinor="6"/>'
        + road(
            section(lane(-1, link + WIDTH + BROKEN + '<speed sOffset="40" max="30" unit="km/h"/>'), lane(-2)),
            after="<signals>" + SIGNAL.format(id=4, more='value="50"') + "</signals>",
        )
        + "</OpenDRIVE>"
    )
    found = list(_ATTRIBUTE.finditer(whole))
    one = data.draw(st.sampled_from(found))
    odd = data.draw(
        st.sampled_from(["", "none", "nan", "inf", "-1", "1e400", "1e7", "0", "-0", "3,5", "true", "²", "1e-300"])
        | st.floats().map(str)
        | st.text(st.characters(exclude_categories=("Cs", "Cc"), exclude_characters='<>&"'), max_size=6)
    )
    text = whole[: one.start(2)] + odd + whole[one.end(2) :]
    try:
        town = parse_opendrive(text.encode())
    except OpenDriveError as error:
        assert str(error)
        return
    for each in town.road.lanes:
        assert math.isfinite(each.speed_limit_mps) and 0.0 < each.speed_limit_mps <= 100.0
        assert all(math.isfinite(x) and math.isfinite(y) for x, y in each.centre.points_m)
        assert 0.0 <= each.width_m <= 200.0
