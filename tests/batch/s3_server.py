"""Just enough of S3 for a client to list, read and write one bucket: an in-memory server on
127.0.0.1.
"""

import email.utils
import hashlib
import threading
import urllib.parse
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from xml.sax.saxutils import escape


class Store(ThreadingHTTPServer):
    """The server; `files` maps "bucket/key" to what it holds."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.files: dict[str, bytes] = {}
        self.full = False  # takes no more files
        threading.Thread(target=self.serve_forever, daemon=True).start()

    @property
    def url(self) -> str:
        """Its address."""
        return f"http://127.0.0.1:{self.server_port}"


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server: Store

    def do_GET(self) -> None:
        name, query = self._asked()
        if name not in self.server.files and "/" not in name.rstrip("/"):
            return self._list(name.rstrip("/"), query)
        self._give(name, with_body=True)

    def do_HEAD(self) -> None:
        self._give(self._asked()[0], with_body=False)

    def do_PUT(self) -> None:
        name, _ = self._asked()
        if self.headers.get(
            "Transfer-Encoding", ""
        ) == "chunked" or "aws-chunked" in self.headers.get("Content-Encoding", ""):
            content = self._unchunked()
        else:
            content = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        if self.server.full:
            return self._answer(
                507, b"<Error><Code>InsufficientStorage</Code><Message>full</Message></Error>"
            )
        self.server.files[name] = content
        self._answer(200, b"", ETag=_etag(content))

    def _unchunked(self) -> bytes:
        content = b""
        while size := int(self.rfile.readline().split(b";")[0], 16):
            content += self.rfile.read(size)
            self.rfile.readline()
        while self.rfile.readline().strip():
            pass
        return content

    def _asked(self) -> tuple[str, dict[str, list[str]]]:
        parts = urllib.parse.urlsplit(self.path)
        return urllib.parse.unquote(parts.path).lstrip("/"), urllib.parse.parse_qs(parts.query)

    def _give(self, name: str, with_body: bool) -> None:
        content = self.server.files.get(name)
        if content is None:
            return self._answer(404, b"<Error><Code>NoSuchKey</Code></Error>" if with_body else b"")
        when = email.utils.formatdate(0, usegmt=True)
        if not with_body:
            return self._answer(
                200, b"", length=len(content), ETag=_etag(content), Last_Modified=when
            )
        first, _, last = self.headers.get("Range", "bytes=0-").removeprefix("bytes=").partition("-")
        part = content[int(first) : int(last) + 1 if last else None]
        self._answer(
            206 if "Range" in self.headers else 200,
            part,
            ETag=_etag(content),
            Last_Modified=when,
            Content_Range=f"bytes {first}-{int(first) + len(part) - 1}/{len(content)}",
        )

    def _list(self, bucket: str, query: dict[str, list[str]]) -> None:
        prefix, divider = query.get("prefix", [""])[0], query.get("delimiter", [""])[0]
        rows, folders = [], set()
        for name, content in sorted(self.server.files.items()):
            if not name.startswith(f"{bucket}/{prefix}"):
                continue
            key = name[len(bucket) + 1 :]
            if divider and divider in key[len(prefix) :]:
                folders.add(prefix + key[len(prefix) :].split(divider)[0] + divider)
                continue
            rows.append(
                f"<Contents><Key>{escape(key)}</Key><LastModified>1970-01-01T00:00:00.000Z</LastModified>"
                f"<ETag>{_etag(content)}</ETag><Size>{len(content)}</Size></Contents>"
            )
        rows += [
            f"<CommonPrefixes><Prefix>{escape(folder)}</Prefix></CommonPrefixes>"
            for folder in sorted(folders)
        ]
        head = f"<Name>{bucket}</Name><IsTruncated>false</IsTruncated>"
        body = f"<ListBucketResult>{head}{''.join(rows)}</ListBucketResult>"
        self._answer(200, body.encode())

    def _answer(self, code: int, body: bytes, length: int | None = None, **headers: str) -> None:
        self.send_response(code)
        for name, value in headers.items():
            self.send_header(name.replace("_", "-"), value)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Nothing is logged."""


def _etag(content: bytes) -> str:
    return f'"{hashlib.md5(content).hexdigest()}"'
