"""Where the cabin page is reached: what the environment says, or this machine alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from chauffeur.concept import ConfigError
from chauffeur.hmi.cabin import Certificate
from chauffeur.hmi.cabin.address import PageAddress, address_of

FILES = {"CHAUFFEUR_CABIN_CERTIFICATE": "car.pem", "CHAUFFEUR_CABIN_KEY": "car.key"}
CERTIFICATE = Certificate(Path("car.pem"), Path("car.key"))


@pytest.mark.parametrize(
    ("said", "files", "at"),
    [
        ("", {}, PageAddress("127.0.0.1", 0, None)),
        (":8443", {}, PageAddress("127.0.0.1", 8443, None)),
        ("localhost", {}, PageAddress("localhost", 0, None)),
        ("car.local:8443", FILES, PageAddress("car.local", 8443, CERTIFICATE)),
        (" car.local:8443 ", FILES, PageAddress("car.local", 8443, CERTIFICATE)),
        ("10.0.0.7:443", FILES, PageAddress("10.0.0.7", 443, CERTIFICATE)),
        ("[fd00::7]:8443", FILES, PageAddress("fd00::7", 8443, CERTIFICATE)),
        ("[::1]", {}, PageAddress("::1", 0, None)),
    ],
)
def test_an_address_is_host_and_port(said: str, files: dict[str, str], at: PageAddress) -> None:
    assert address_of({"CHAUFFEUR_CABIN": said, **files}) == at


@pytest.mark.parametrize(
    "said", ["https://car.local:8443", "car.local:", "car.local:port", "fd00::7", "car local", "car.local:70000"]
)
def test_what_is_no_address_is_refused_with_an_example(said: str) -> None:
    with pytest.raises(ConfigError, match="is no address") as told:
        address_of({"CHAUFFEUR_CABIN": said})
    assert "car.local:8443" in told.value.hint


@pytest.mark.parametrize("named", FILES)
def test_a_certificate_without_its_key_is_none(named: str) -> None:
    (other,) = FILES.keys() - {named}
    with pytest.raises(ConfigError) as told:
        address_of({"CHAUFFEUR_CABIN": "car.local:8443", named: FILES[named]})
    assert other in told.value.hint
