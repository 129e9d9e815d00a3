"""The package index in force, and asking it: its certificates, proxy and password."""

import base64
import configparser
import html.parser
import http.client
import json
import os
import re
import sys
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

from .messages import Stop, with_variable

PYPI = "https://pypi.org/simple"


class Index(NamedTuple):
    """Where packages come from: what UV_*, PIP_* and pip's own configuration say, in this order."""

    url: str = PYPI
    extra: Tuple[str, ...] = ()
    find_links: Tuple[str, ...] = ()
    no_index: bool = False
    trusted: Tuple[str, ...] = ()
    certificates: str = ""
    proxy: str = ""


def pip_configuration_files(environment: Mapping[str, str]) -> List[Path]:
    """pip's configuration files, the last one winning."""
    home = Path(os.path.expanduser("~"))
    named = environment.get("PIP_CONFIG_FILE", "")
    if named == os.devnull:
        return []
    if os.name == "nt":
        files = [Path(environment.get("ProgramData", "C:/ProgramData")) / "pip/pip.ini", home / "pip/pip.ini"]
        files += [Path(environment.get("APPDATA", str(home))) / "pip/pip.ini", Path(sys.prefix) / "pip.ini"]
    else:
        shared = environment.get("XDG_CONFIG_DIRS") or "/etc/xdg"
        files = [Path(folder) / "pip/pip.conf" for folder in reversed(shared.split(":"))] + [Path("/etc/pip.conf")]
        if sys.platform == "darwin":
            files = [Path("/Library/Application Support/pip/pip.conf")]
            files += [home / "Library/Application Support/pip/pip.conf"]
        personal = Path(environment.get("XDG_CONFIG_HOME") or str(home / ".config"))
        files += [home / ".pip/pip.conf", personal / "pip/pip.conf", Path(sys.prefix) / "pip.conf"]
    return files + ([Path(named)] if named else [])


def pip_configuration(files: Sequence[Path]) -> Dict[str, str]:
    """What pip's files say for an installation, keys with dashes."""
    found = {}  # type: Dict[str, str]
    for section in ("global", "install"):  # the command's own section wins over the global one
        for file in files:
            parser = configparser.RawConfigParser(strict=False)
            try:
                parser.read_string(file.read_text(encoding="utf-8-sig"))
            except (OSError, UnicodeDecodeError, configparser.Error):
                continue  # absent, or not one that pip could read either
            if parser.has_section(section):
                found.update((key.lower().replace("_", "-"), value) for key, value in parser.items(section))
    return found


def index_in_force(environment: Mapping[str, str], files: Optional[Sequence[Path]] = None) -> Index:
    """Read which package index, certificates and proxy hold here."""
    configured = pip_configuration(pip_configuration_files(environment) if files is None else files)

    def pip(key: str) -> str:
        return environment.get("PIP_" + key.upper().replace("-", "_")) or configured.get(key, "")

    def several(*texts: str) -> Tuple[str, ...]:
        words = [re.sub(r"^[A-Za-z0-9_.-]+=(?=[a-z]+:)", "", word) for text in texts for word in text.split()]
        return tuple(dict.fromkeys(words))

    uv = environment.get("UV_DEFAULT_INDEX") or environment.get("UV_INDEX_URL") or ""
    links = several(environment.get("UV_FIND_LINKS", "").replace(",", " "), pip("find-links"))
    certificates = environment.get("SSL_CERT_FILE") or pip("cert")
    for other in ("REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE"):
        certificates = certificates or environment.get(other, "")
    return Index(
        url=(several(uv or pip("index-url")) or (PYPI,))[0].rstrip("/"),
        extra=several(
            environment.get("UV_INDEX", ""), environment.get("UV_EXTRA_INDEX_URL", ""), pip("extra-index-url")
        ),
        find_links=tuple(link for link in links if "://" in link or os.path.isdir(link)),
        no_index=pip("no-index").lower() in ("1", "true", "yes", "on") or bool(environment.get("UV_NO_INDEX")),
        trusted=several(environment.get("UV_INSECURE_HOST", "").replace(",", " "), pip("trusted-host")),
        certificates=certificates if os.path.exists(certificates) else "",
        proxy=pip("proxy"),
    )


def without_secret(url: str) -> str:
    """An address as it may be printed: without user name and password."""
    parts = urllib.parse.urlsplit(url)
    return urllib.parse.urlunsplit(parts._replace(netloc=parts.netloc.rpartition("@")[2]))


def _origin(url: str) -> Tuple[str, str]:
    parts = urllib.parse.urlsplit(url)
    return parts.scheme, parts.netloc.rpartition("@")[2]


class _Redirects(urllib.request.HTTPRedirectHandler):
    """Follows redirects, and takes the password along to the same host only."""

    def redirect_request(self, req: Any, fp: Any, code: int, msg: str, headers: Any, newurl: str) -> Any:
        new = super().redirect_request(req, fp, code, msg, headers, newurl)
        secret = req.unredirected_hdrs.get("Authorization")
        if new is not None and secret and _origin(newurl) == _origin(req.full_url):
            new.add_unredirected_header("Authorization", secret)
        return new


def _secret(url: str, index: Index) -> str:
    """The Authorization header for an address: from itself, from the index on the same host, or from netrc."""
    for address in (url,) + tuple(a for a in (index.url,) + index.extra if _origin(a) == _origin(url)):
        parts = urllib.parse.urlsplit(address)
        if parts.username:
            pair = urllib.parse.unquote(parts.username), urllib.parse.unquote(parts.password or "")
            break
    else:
        import netrc

        try:
            login = netrc.netrc(os.environ.get("NETRC")).authenticators(urllib.parse.urlsplit(url).hostname or "")
        except (OSError, netrc.NetrcParseError):
            login = None
        if not login:
            return ""
        pair = login[0], login[2] or ""
    return "Basic " + base64.b64encode(":".join(pair).encode("utf-8")).decode("ascii")


def open_url(url: str, index: Index, **headers: str) -> Any:
    """Open an address with the certificates, proxy and password in force."""
    import ssl

    file = index.certificates if os.path.isfile(index.certificates) else None
    context = ssl.create_default_context(
        cafile=file, capath=index.certificates if index.certificates and not file else None
    )
    parts = urllib.parse.urlsplit(url)
    if parts.hostname in index.trusted or _origin(url)[1] in index.trusted:
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # what is fetched is checked by its hash
    handlers = [_Redirects(), urllib.request.HTTPSHandler(context=context)]  # type: List[Any]
    if index.proxy and not urllib.request.getproxies():
        handlers.append(urllib.request.ProxyHandler({"http": index.proxy, "https": index.proxy}))
    request = urllib.request.Request(without_secret(url), headers={"User-Agent": "course.py"})
    for key, value in headers.items():
        request.add_header(key, value)
    secret = _secret(url, index)
    if secret:
        request.add_unredirected_header("Authorization", secret)
    return urllib.request.build_opener(*handlers).open(request, timeout=30)


def not_answering(index: Index) -> Optional[Exception]:
    """What is in the way of asking the index; None where it answers."""
    try:
        with open_url(index.url.rstrip("/") + "/uv/", index):
            return None
    except (OSError, http.client.HTTPException) as error:  # a URLError is an OSError
        return error


class _Links(html.parser.HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.links = []  # type: List[str]

    def handle_starttag(self, tag: str, attrs: List[Tuple[str, Optional[str]]]) -> None:
        self.links += [value for key, value in attrs if tag == "a" and key == "href" and value]


def link_to(filename: str, page: str, page_url: str) -> Optional[str]:
    """The absolute address of a file on a page of the simple API, HTML or JSON; None where it is not there."""
    if page.lstrip().startswith("{"):
        links = [file["url"] for file in json.loads(page).get("files", []) if file.get("filename") == filename]
    else:
        parser = _Links()
        parser.feed(page)
        links = parser.links
    for link in links:
        address = urllib.parse.urldefrag(urllib.parse.urljoin(page_url, link))[0]
        if urllib.parse.unquote(urllib.parse.urlsplit(address).path).rpartition("/")[2] == filename:
            return address
    return None


def unreachable(index: Index, reason: object) -> Stop:
    """The sentence for an index that does not answer."""
    if isinstance(reason, urllib.error.HTTPError):
        reason = f"HTTP {reason.code} {reason.reason}"
    reason = getattr(reason, "reason", None) or reason
    reason = getattr(reason, "strerror", None) or reason
    if "CERTIFICATE_VERIFY_FAILED" in str(reason):
        return Stop(
            "index",
            f"The certificate of the package index {without_secret(index.url)} is not trusted here: name the file of "
            "your institution's certificates.",
            with_variable("SSL_CERT_FILE", "/path/to/certificates.pem"),
        )
    told = str(reason) or type(reason).__name__
    return Stop(
        "index",
        f"The package index {without_secret(index.url)} cannot be reached ({told}): check the network, or name your "
        "institution's index.",
        with_variable("UV_DEFAULT_INDEX", "https://packages.example.org/simple"),
    )
