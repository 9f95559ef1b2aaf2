"""V in a request: pictures go out as image parts, and an endpoint that reads none is told of in words."""

from __future__ import annotations

import base64

import numpy as np
import pytest
from server import REPLY, fails, whole

from chauffeur.concept import CameraImage, Program
from chauffeur.planners.llm_context import tokens_about
from chauffeur.planners.llm_errors import EndpointError
from chauffeur.planners.prompts import build_messages, words_of

pytestmark = pytest.mark.server


def picture(camera: str = "front", shade: int = 40) -> CameraImage:
    pixels = np.zeros((16, 24, 3), np.uint8)
    pixels[:8, :, 2], pixels[8:] = 200, shade
    return CameraImage(camera, 1.5, pixels)


def test_pictures_go_out_as_they_are_each_behind_the_name_of_its_camera(server, bench, make_request):
    views = (picture(), CameraImage("CAM_BACK", 1.5, picture(shade=90).png()))
    plan = bench.plan(asked=make_request("hold 25 m/s", images=views))
    assert isinstance(plan.policy, Program)
    (sent,) = server.requests
    content = sent.body["messages"][1]["content"]
    assert [part["type"] for part in content] == ["text", "image_url", "text", "image_url", "text"]
    assert content[0]["text"] == "Camera front:" and content[2]["text"] == "Camera CAM_BACK:"
    assert "hold 25 m/s" in content[4]["text"]
    for part, view in zip((content[1], content[3]), views, strict=True):
        kind, data = part["image_url"]["url"].split(",")
        assert kind == "data:image/png;base64"
        assert CameraImage(view.camera, view.time_s, base64.b64decode(data)) == view


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (400, "This model does not support image input."),
        (404, "No endpoints found that support image input"),
        (422, "messages.1.content: Input should be a valid string"),
        (500, "image input is not supported - hint: if this is unexpected, you may need to provide the mmproj"),
        (400, "At most 0 image(s) may be provided in one prompt."),
    ],
)
def test_an_endpoint_without_eyes_is_told_of_in_words(server, bench, make_request, status, said):
    server.script(fails(status, said), whole(REPLY))
    with pytest.raises(EndpointError, match="takes no pictures") as caught:
        bench.plan(asked=make_request("hold 25 m/s", images=(picture(),)))
    assert caught.value.kind == "no_vision" and "reads images" in caught.value.hint
    assert len(server.requests) == 1  # asking again would not help


def test_other_refusals_stay_what_they_are(server, bench, make_request):
    server.script(fails(400, "This model's maximum context length is 2048 tokens, you requested 9000 tokens."))
    with pytest.raises(EndpointError) as caught:
        bench.plan(asked=make_request("hold 25 m/s", images=(picture(),)))
    assert caught.value.kind == "context"
    server.script(fails(400, "This model does not support image input."))
    with pytest.raises(EndpointError) as caught:
        bench.plan(asked=make_request("hold 25 m/s"))
    assert caught.value.kind == "bad_request"


def test_pictures_count_for_kept_replies_and_not_for_the_estimate_of_tokens(server, bench, make_request, tmp_path):
    from chauffeur.planners.cache import ReplyCache

    cache = ReplyCache(tmp_path)
    for shade in (40, 40, 90):
        bench.plan(asked=make_request("hold 25 m/s", images=(picture(shade=shade),)), cache=cache)
    assert len(server.requests) == 2  # the second was kept, the third shows something else
    plain, seen = (build_messages(make_request("go", images=views)) for views in ((), (picture(),)))
    assert words_of(seen[1]).endswith(words_of(plain[1]))
    assert abs(tokens_about(seen) - tokens_about(plain)) < 10
