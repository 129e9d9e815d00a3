"""course.py: the package index in force, and fetching uv's wheel from it, whole and right or not at all."""

from __future__ import annotations

import hashlib
import os

import pytest
from launcher_helpers import ROOT, TINY, TINY_NAME, serving

from course_lib.launch.bootstrap import installer, messages, package_index, platform_facts, uv


@pytest.fixture(autouse=True)
def nobodys_settings(monkeypatch, tmp_path):
    """No proxy for loopback, no netrc, no waiting between tries."""
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    monkeypatch.setenv("NETRC", str(tmp_path / "netrc"))
    monkeypatch.setattr(uv.time, "sleep", lambda seconds: None)


def configured(text: str, tmp_path, **environment: str):
    file = tmp_path / "pip.conf"
    file.write_text(text, encoding="utf-8")
    return package_index.index_in_force(environment, [file])


def test_without_settings_it_is_pypi(tmp_path):
    assert package_index.index_in_force({}, []) == package_index.Index()
    assert package_index.index_in_force({}, [tmp_path / "none.conf"]).url == "https://pypi.org/simple"


def test_pip_conf_is_honoured_the_later_file_and_the_command_winning(tmp_path):
    index = configured("[global]\nindex-url = https://a.example/simple/\n", tmp_path)
    assert index.url == "https://a.example/simple"
    later = tmp_path / "later.conf"
    later.write_text("[global]\nindex_url: https://b.example/simple\n", encoding="utf-8")
    assert package_index.index_in_force({}, [tmp_path / "pip.conf", later]).url == "https://b.example/simple"
    both = "[install]\nindex-url = https://i.example/simple\n[global]\nindex-url = https://g.example/simple\n"
    assert configured(both, tmp_path).url == "https://i.example/simple"


def test_variables_win_over_files_and_uvs_over_pips(tmp_path):
    text = "[global]\nindex-url = https://file.example/simple\n"
    pip, uv = "https://pip.example/simple", "https://uv.example/simple"
    assert configured(text, tmp_path, PIP_INDEX_URL=pip).url == pip
    assert configured(text, tmp_path, PIP_INDEX_URL=pip, UV_INDEX_URL=uv).url == uv
    assert configured(text, tmp_path, UV_INDEX_URL=pip, UV_DEFAULT_INDEX=f"campus={uv}/").url == uv


def test_the_rest_of_pips_settings(tmp_path):
    certificates = tmp_path / "ca.pem"
    certificates.write_text("", encoding="utf-8")
    text = (
        "[global]\nextra-index-url =\n    https://x.example/simple\n    https://y.example/simple\n"
        f"find-links = {tmp_path} /no/such/folder\ntrusted-host = x.example\ncert = {certificates}\nno-index = true\n"
    )
    index = configured(text, tmp_path)
    assert index.extra == ("https://x.example/simple", "https://y.example/simple")
    assert index.find_links == (str(tmp_path),)
    assert index.trusted == ("x.example",) and index.no_index and index.certificates == str(certificates)


def test_a_damaged_pip_conf_is_passed_over(tmp_path):
    assert configured("index-url = no section\n", tmp_path).url == package_index.PYPI


def test_pip_config_file_is_read_last_or_switches_all_off(tmp_path):
    files = package_index.pip_configuration_files({"PIP_CONFIG_FILE": str(tmp_path / "mine.conf")})
    assert files[-1] == tmp_path / "mine.conf" and len(files) > 1
    assert package_index.pip_configuration_files({"PIP_CONFIG_FILE": os.devnull}) == []


def test_uv_is_told_the_index_in_force_and_nothing_that_changes_what_is_installed(monkeypatch, tmp_path):
    monkeypatch.setenv("UV_EXCLUDE_NEWER", "2020-01-01")
    monkeypatch.setenv("PYTHONPATH", "/opt/ros/lib")
    monkeypatch.setenv("UV_CACHE_DIR", str(tmp_path))
    index = package_index.Index(
        url="https://a.example/simple", extra=("https://b.example/simple",), trusted=("a.example",)
    )
    environment = installer.uv_environment(index)
    assert environment["UV_DEFAULT_INDEX"] == "https://a.example/simple"
    assert environment["UV_INDEX"] == "https://b.example/simple"
    assert environment["UV_INSECURE_HOST"] == "a.example"
    assert not {"UV_EXCLUDE_NEWER", "PYTHONPATH"} & set(environment)
    monkeypatch.delenv("UV_DEFAULT_INDEX", raising=False)
    assert "UV_DEFAULT_INDEX" not in installer.uv_environment(
        package_index.Index()
    )  # uv's own configuration may name one


def test_passwords_are_never_shown():
    secret = "https://kim:s3cret@a.example:8443/simple"
    assert package_index.without_secret(secret) == "https://a.example:8443/simple"
    stop = package_index.unreachable(package_index.Index(url=secret), OSError("refused"))
    assert "s3cret" not in stop.sentence + stop.mend and "https://a.example:8443/simple" in stop.sentence


@pytest.mark.parametrize(
    "page",
    [
        '<a href="../../files/uv-1-py3-none-any.whl#sha256=ab" data-requires-python="&gt;=3">uv-1-py3-none-any.whl</a>',
        '<a href="/files/uv-1-py3-none-any.whl">uv</a><a href="/files/uv-2-py3-none-any.whl">uv</a>',
        '{"files": [{"filename": "uv-1-py3-none-any.whl", "url": "https://a.example/files/uv-1-py3-none-any.whl"}]}',
        '{"files": [{"filename": "uv-1-py3-none-any.whl", "url": "../../files/uv-1-py3-none-any.whl"}]}',
    ],
)
def test_links_of_html_and_json_pages_are_found(page):
    found = package_index.link_to("uv-1-py3-none-any.whl", page, "https://a.example/simple/uv/")
    assert found == "https://a.example/files/uv-1-py3-none-any.whl"
    assert package_index.link_to("uv-3-py3-none-any.whl", page, "https://a.example/simple/uv/") is None


def test_the_lock_names_a_uv_for_every_machine_of_open3d():
    lock = (ROOT / "uv.lock").read_text(encoding="utf-8")
    for system, machine in (
        ("Linux", "x86_64"), ("Linux", "aarch64"), ("Darwin", "arm64"), ("Windows", "AMD64"),
    ):  # fmt: skip
        wheel = uv.locked_uv(lock, platform_facts.Facts((3, 12, 0), 64, system, machine))
        assert wheel.filename.startswith(f"uv-{wheel.version}-py3-none-") and len(wheel.sha256) == 64
        assert wheel.filename.endswith(f"{machine.lower()}.whl") or "aarch64" in wheel.filename


def tiny_wheel(sha256: str = hashlib.sha256(TINY).hexdigest()):
    return uv.Wheel("1.0", TINY_NAME, sha256)


@pytest.fixture
def uv_project(monkeypatch):
    """An index whose project `uv` holds the tiny wheel."""
    with serving({TINY_NAME: TINY}, password="open sesame") as index:
        plain = index.answer
        index.answer = lambda request: (
            setattr(request, "path", request.path.replace("/uv/", "/tiny/")),
            plain(request),
        )
        yield index


def in_force(index, **more):
    address = index.url.replace("open sesame", "open%20sesame")
    return package_index.Index(url=address, **more)


def test_a_wheel_comes_from_the_index_with_its_password(uv_project, tmp_path):
    uv.fetch(tiny_wheel(), tmp_path / "w.whl", in_force(uv_project))
    assert (tmp_path / "w.whl").read_bytes() == TINY
    assert all(allowed for _, allowed in uv_project.asked)
    assert uv_project.paths() == ["/simple/tiny/", f"/files/{TINY_NAME}"]


def test_a_password_may_stand_in_netrc(uv_project, tmp_path, monkeypatch):
    netrc = tmp_path / "netrc"
    netrc.write_text('machine 127.0.0.1 login reader password "open sesame"\n', encoding="utf-8")
    netrc.chmod(0o600)
    address = package_index.without_secret(in_force(uv_project).url)
    uv.fetch(tiny_wheel(), tmp_path / "w.whl", package_index.Index(url=address))
    assert (tmp_path / "w.whl").read_bytes() == TINY


def test_a_wrong_password_is_one_sentence(uv_project, tmp_path):
    address = in_force(uv_project).url.replace("sesame", "barley")
    with pytest.raises(messages.Stop, match="cannot be reached .*401") as stopped:
        uv.fetch(tiny_wheel(), tmp_path / "w.whl", package_index.Index(url=address))
    assert stopped.value.code == "index" and "barley" not in stopped.value.sentence


def test_a_download_is_resumed_where_it_stopped(uv_project, tmp_path):
    (tmp_path / "w.whl.part").write_bytes(TINY[:100])
    uv.fetch(tiny_wheel(), tmp_path / "w.whl", in_force(uv_project))
    assert (tmp_path / "w.whl").read_bytes() == TINY and not (tmp_path / "w.whl.part").exists()
    assert len(uv_project.asked) == 2


def test_a_wrong_beginning_is_thrown_away(uv_project, tmp_path):
    (tmp_path / "w.whl.part").write_bytes(b"another file, cut off")
    uv.fetch(tiny_wheel(), tmp_path / "w.whl", in_force(uv_project))
    assert (tmp_path / "w.whl").read_bytes() == TINY


def test_a_file_of_another_hash_is_refused_and_not_kept(uv_project, tmp_path):
    with pytest.raises(messages.Stop, match="is not the file that uv.lock names") as stopped:
        uv.fetch(tiny_wheel("0" * 64), tmp_path / "w.whl", in_force(uv_project))
    assert stopped.value.code == "content" and "sesame" not in stopped.value.sentence
    assert list(tmp_path.glob("w.whl*")) == []


def test_an_index_without_the_file_is_named(uv_project, tmp_path):
    missing = uv.Wheel("2.0", "uv-2.0-py3-none-any.whl", "0" * 64)
    with pytest.raises(messages.Stop, match="does not hold uv-2.0-py3-none-any.whl") as stopped:
        uv.fetch(missing, tmp_path / "w.whl", in_force(uv_project))
    assert stopped.value.code == "content"


def test_an_extra_index_is_asked_where_the_first_has_nothing(uv_project, tmp_path):
    with serving({}) as empty:
        index = package_index.Index(url=empty.url, extra=(in_force(uv_project).url,))
        uv.fetch(tiny_wheel(), tmp_path / "w.whl", index)
    assert (tmp_path / "w.whl").read_bytes() == TINY and empty.paths() == ["/simple/uv/"]


def test_a_folder_of_wheels_needs_no_index(tmp_path):
    (tmp_path / "wheels").mkdir()
    (tmp_path / "wheels" / TINY_NAME).write_bytes(TINY)
    index = package_index.Index(find_links=(str(tmp_path / "wheels"),), no_index=True)
    uv.fetch(tiny_wheel(), tmp_path / "w.whl", index)
    assert (tmp_path / "w.whl").read_bytes() == TINY


def test_nobody_listening_is_one_sentence_with_a_command(tmp_path):
    with serving({}) as index:
        address = index.url
    with pytest.raises(messages.Stop, match="cannot be reached .*check the network") as stopped:
        uv.fetch(tiny_wheel(), tmp_path / "w.whl", package_index.Index(url=address))
    assert stopped.value.code == "index" and "UV_DEFAULT_INDEX=" in stopped.value.mend


def test_the_password_does_not_follow_a_redirect_to_another_host():
    request = package_index.urllib.request.Request("http://127.0.0.1:1/a")
    request.add_unredirected_header("Authorization", "Basic x")
    follow = package_index._Redirects()
    there = follow.redirect_request(request, None, 302, "Found", {}, "http://127.0.0.1:2/a")
    same = follow.redirect_request(request, None, 302, "Found", {}, "http://127.0.0.1:1/b")
    assert there.get_header("Authorization") is None
    assert same.get_header("Authorization") == "Basic x"
