"""Addresses from outside: what is one, what of it may be shown, and where a key may go."""

from __future__ import annotations

import ipaddress
import string

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from chauffeur.concept import ConfigError
from chauffeur.concept.addresses import Address, http_address, read_key

EXAMPLE = "http://localhost:8080"
SECRET = "s3cr3t-wort"

_NAMES = st.lists(st.text(string.ascii_letters + string.digits, min_size=1, max_size=8), min_size=1, max_size=4).map(
    ".".join
)
_HOSTS = _NAMES.map(lambda name: f"h{name}") | st.ip_addresses(v=4).map(str) | st.ip_addresses(v=6).map("[{}]".format)
_PORTS = st.none() | st.integers(0, 65535)
_PATHS = st.lists(st.text(string.ascii_letters + "-._~", min_size=1), max_size=3).map("/".join)
_OWN = ("localhost", "BOX", "a.localhost", "printer.local", "x.lan", "x.internal", "x.home.arpa", "127.0.0.1")
_OWN += ("10.1.2.3", "192.168.0.9", "172.16.0.1", "169.254.1.1", "[::1]", "[fe80::1]", "[fd00::5]")


def checked(text: str) -> Address:
    return http_address(text, "The address of the test", example=EXAMPLE, key_place="TEST_KEY")


@given(st.sampled_from(["http", "https", "HTTPS"]), _HOSTS, _PORTS, _PATHS, st.sampled_from(["", "/", "//"]))
def test_an_address_keeps_scheme_host_port_and_path(
    scheme: str, host: str, port: int | None, path: str, end: str
) -> None:
    authority = host if port is None else f"{host}:{port}"
    path = f"/{path}" if path else ""
    found = checked(f" {scheme}://{authority}{path}{end}\n")
    assert found.url == f"{scheme.lower()}://{authority.lower()}{path}"
    assert found.host == host.lower().strip("[]")
    assert checked(found.url) == found, "what was checked once stays as it is"


@given(st.text())
@example("http://[")
@example("http://[::1")
@example("http://h:99999/v1")
@example("http://h:x/v1")
@example("http://")
@example("ftp://x/v1")
@example("localhost:8000")
@example("//host/v1")
@example("")
def test_any_text_is_an_address_or_refused(text: str) -> None:
    try:
        found = checked(text)
    except ConfigError as error:
        assert error.message.startswith("The address of the test")
        assert error.hint
    else:
        assert found.url.startswith(("http://", "https://")) and found.host


@pytest.mark.parametrize("text", ["ftp://host/v1", "host", "http://", "http://[", "https://h:99999/v1"])
def test_what_is_no_http_address_is_named_with_a_good_one(text: str) -> None:
    with pytest.raises(ConfigError) as caught:
        checked(text)
    assert str(caught.value) == f"The address of the test is not an HTTP address. Give one such as {EXAMPLE}."


@pytest.mark.parametrize(
    "text",
    [
        f"http://me:{SECRET}@host.example/v1",
        f"http://{SECRET}@host.example/v1",
        f"http://:{SECRET}@host.example/v1",
        f"https://host.example/v1?key={SECRET}",
        f"https://host.example/v1#{SECRET}",
    ],
)
def test_an_address_with_a_secret_is_refused_and_the_secret_not_shown(text: str) -> None:
    with pytest.raises(ConfigError, match="carries more than host and path") as caught:
        checked(text)
    assert "host.example" in caught.value.message and caught.value.hint.endswith("a key belongs into TEST_KEY.")
    assert SECRET not in f"{caught.value} {caught.value!r}"


@pytest.mark.parametrize("host", _OWN)
def test_hosts_of_ones_own_network(host: str) -> None:
    assert checked(f"http://{host}:8000/v1").local


@pytest.mark.parametrize("host", ["example.com", "8.8.8.8", "[2606:4700::1111]", "local.example", "127.0.0.1.nip.io"])
def test_hosts_of_the_world(host: str) -> None:
    assert not checked(f"http://{host}/v1").local


@given(st.ip_addresses())
def test_a_number_is_local_exactly_where_no_router_carries_it(number: ipaddress.IPv4Address) -> None:
    host = f"[{number}]" if number.version == 6 else str(number)
    assert checked(f"http://{host}").local == (number.is_private or number.is_loopback or number.is_link_local)


def test_the_first_variable_that_is_set_counts() -> None:
    environ = {"FIRST": " \n", "SECOND": f" {SECRET}\n", "THIRD": "other"}
    assert read_key(checked("https://host.example"), ("FIRST", "SECOND", "THIRD"), environ) == (SECRET, "SECOND")
    assert read_key(checked("https://host.example"), ("FIRST", "FOURTH"), environ) is None
    assert read_key(checked("https://host.example"), (), environ) is None


@pytest.mark.parametrize("key", [f"two {SECRET}", f"línea{SECRET}", f"a\n{SECRET}", f"a\x00{SECRET}"])
def test_what_is_no_key_is_refused_and_not_shown(key: str) -> None:
    with pytest.raises(ConfigError, match="TEST_KEY holds characters no key has") as caught:
        read_key(checked("https://host.example"), ("TEST_KEY",), {"TEST_KEY": key})
    assert SECRET not in f"{caught.value} {caught.value!r}"


@given(st.sampled_from(["http", "https"]), _HOSTS)
@example("http", "example.com")
@example("http", "localhost")
def test_a_key_crosses_a_public_network_encrypted_or_not_at_all(scheme: str, host: str) -> None:
    address = checked(f"{scheme}://{host}/v1")
    environ = {"TEST_KEY": SECRET}
    if scheme == "https" or address.local:
        assert read_key(address, ("TEST_KEY",), environ) == (SECRET, "TEST_KEY")
        return
    with pytest.raises(ConfigError, match="unencrypted") as caught:
        read_key(address, ("TEST_KEY",), environ)
    assert "TEST_KEY" in str(caught.value) and SECRET not in str(caught.value)
    assert read_key(address, ("TEST_KEY",), {}) is None
