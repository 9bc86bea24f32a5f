# SPDX-License-Identifier: Apache-2.0
"""Pictures and numbers of the volumes on a Blockwalk server. One file, the standard library alone.

    import blockwalk
    server = blockwalk.Server("http://127.0.0.1:8080/")
    scan = server.volume("scan")
    scan.image(size=(640, 480), mode="mip")                 # shows itself in a notebook
    scan.image(eye=(1, 2, 3)).save("picture.png")
    scan.slice(axis="z", index=100).save("slice.png")
    scan.slice(axis="z", index=100, format="npy")           # an array [y, x]
    scan.region(level=2, box=(0, 0, 0, 64, 64, 64))         # an array [z, y, x]
    scan.animate(frames=100, size=(640, 480)).save("turn.zip")
    scan.pick(x=320, y=240, size=(640, 480))                # a dict

Members are those of the interface (docs/protocol.md), with _ for -: lod_alpha; deadline_ms is one. Their values are
text as in an address, or numbers, tuples of them, and booleans: size=(640, 480), range=(10, 200), eye=(1, 2, 3),
lit=True. Members of one item a channel take a list: range=[(10, 200), None].

Arrays are numpy's where it is installed, else memoryviews of that shape: a[z, y, x] is a voxel of both.
"""
import ast
import http.client
import json
import os
import ssl
import struct
import urllib.error
import urllib.parse
import urllib.request

__all__ = ["Server", "Volume", "Picture", "BlockwalkError"]

_PAIRS = {"range", "window"}  # of which two numbers are lo:hi
_NUMPY_CODES = {"|u1": "B", "|i1": "b", "<u2": "H", "<i2": "h", "<f4": "f"}


class BlockwalkError(Exception):
    """What the server refuses: `status`, `detail`, and `field`, the member that is to blame, or None."""

    def __init__(self, status, detail, field=None):
        super().__init__(f"{status}: {detail}")
        self.status, self.detail, self.field = status, detail, field


class Picture:
    """An image as it was sent: `data` in the format `type`, and `info`, what the server says of it."""

    def __init__(self, data, mime_type, info):
        self.data, self.type, self.info = data, mime_type, info

    def save(self, path):
        with open(path, "wb") as file:
            file.write(self.data)

    def _repr_mimebundle_(self, include=None, exclude=None):
        return {self.type: self.data}

    def __repr__(self):
        return f"<blockwalk.Picture {self.type}, {len(self.data)} bytes>"


class Server:
    """`token` (or BLOCKWALK_TOKEN) lets in where the server asks for one; `ca` is a file of certificates to trust."""

    def __init__(self, url="http://127.0.0.1:8080/", token=None, ca=None, timeout=300):
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.netloc:
            raise ValueError(f"url: {url!r} is no http://HOST:PORT/ or https://HOST:PORT/")
        self._root = f"{parts.scheme}://{parts.netloc}"
        self._token = os.environ.get("BLOCKWALK_TOKEN") if token is None else token
        self._timeout = timeout
        handlers = []
        if parts.scheme == "https":
            handlers.append(urllib.request.HTTPSHandler(context=ssl.create_default_context(cafile=ca)))
        self._opener = urllib.request.build_opener(*handlers)

    def volumes(self):
        """What the server has, a dict each: id, name, state, type, dims."""
        return self._json("/api/v1/volumes")["volumes"]

    def volume(self, name):
        return Volume(self, name)

    def device(self):
        return self._json("/api/v1/device")

    def _post(self, path, body):
        request = urllib.request.Request(self._root + path, json.dumps(body).encode(),
                                         {"Content-Type": "application/json"})
        return self._open(request)

    def _get(self, path, members=()):
        query = urllib.parse.urlencode([(_member(key), _text(key, value)) for key, value in members], safe=",:;")
        with self._open(urllib.request.Request(self._root + path + ("?" + query if query else ""))) as reply:
            return reply.read(), reply.headers

    def _open(self, request):
        if self._token:
            request.add_header("Authorization", "Bearer " + self._token)
        try:
            return self._opener.open(request, timeout=self._timeout)
        except urllib.error.HTTPError as error:
            raise _refusal(error) from None

    def _json(self, path, members=()):
        return json.loads(self._get(path, members)[0])


class Volume:
    def __init__(self, server, name):
        self._server = server
        self.id = name
        self._path = "/api/v1/volumes/" + urllib.parse.quote(name, safe="")

    def info(self):
        """Everything known of it: dims, type, spacing, channels, levels, default_view ..."""
        return self._server._json(self._path)

    def image(self, **view):
        """The picture of a view; format="raw" gives the array [row, column, part] of its pixels or numbers."""
        data, headers = self._server._get(self._path + "/image", view.items())
        stats = json.loads(headers.get("X-Blockwalk-Stats", "{}"))
        if view.get("format") != "raw":
            return Picture(data, headers.get_content_type(), stats)
        raw = json.loads(headers["X-Blockwalk-Raw"])
        shape = (raw["height"], raw["width"]) + ((raw["channels"],) if raw["channels"] > 1 else ())
        return _array(data, "<f4" if raw["type"] == "f32" else "|u1", shape)

    def animate(self, save=None, **members):
        """Pictures one after the other: a turn, turntable={"seconds": 4, "axis": (0, 1, 0)} of view={...}, or keys,
        [{"seconds": 0, "view": {...}}, ...]; frames or fps, size, format "zip" (of PNG) or "webp". A Picture, or with
        `save`, a path, what the server says of it, and the file is written as it comes. Views here are the interface's
        JSON: {"lod-alpha": 0.5, "range": [10, 200]}."""
        with self._server._post(self._path + "/animate", members) as reply:
            info = json.loads(reply.headers["X-Blockwalk-Animation"])
            try:
                if save is None:
                    return Picture(reply.read(), reply.headers.get_content_type(), info)
                _write(save, reply)
            except http.client.IncompleteRead:
                raise BlockwalkError(200, "the animation broke off: the server ended it") from None
        return info

    def slice(self, **members):
        """A plane: a picture, or with format="npy" the array [row, column] of its values (channels in front)."""
        data, headers = self._server._get(self._path + "/slice", members.items())
        if members.get("format") == "npy":
            return _npy(data)
        return Picture(data, headers.get_content_type(), json.loads(headers["X-Blockwalk-Slice"]))

    def region(self, **members):
        """Voxels of a box of a level: the array [z, y, x] (channels in front, the four of a colour behind)."""
        if "format" in members:
            raise TypeError("region: format: this is an array; read the address itself for a file")
        return _npy(self._server._get(self._path + "/region", [*members.items(), ("format", "npy")])[0])

    def pick(self, x, y, **view):
        """What the pixel shows: {"hit": True, "voxel", "world", "t", "level", "values"} or {"hit": False}."""
        return self._server._json(self._path + "/pick", [*view.items(), ("x", x), ("y", y)])

    def explain(self, **view):
        """Why the picture is empty or coarse."""
        return self._server._json(self._path + "/explain", view.items())

    def __repr__(self):
        return f"<blockwalk.Volume {self.id}>"


# Python has no - in names, the protocol has it in all but these.
_UNDERSCORED = {"deadline_ms"}


def _member(name):
    return name if name in _UNDERSCORED else name.replace("_", "-")


def _write(path, reply):
    """The file is there once it is whole."""
    partial = f"{path}.partial"
    try:
        with open(partial, "wb") as file:
            while piece := reply.read(1 << 20):
                file.write(piece)
        os.replace(partial, path)
    finally:
        if os.path.exists(partial):
            os.remove(partial)


def _text(name, value):
    if isinstance(value, list):  # an item a channel, or a plane
        return ";".join("" if item is None else _text(name, item) for item in value)
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    try:
        parts = [_number(part) for part in value]
    except TypeError:
        return _number(value)
    return ("x" if name == "size" else ":" if name in _PAIRS else ",").join(parts)


def _number(value):
    number = float(value)
    return str(int(number)) if number.is_integer() and abs(number) < 2**53 else repr(number)


def _refusal(error):
    body = error.read()
    try:
        problem = json.loads(body)
        return BlockwalkError(error.code, problem["detail"], problem.get("field"))
    except (ValueError, KeyError, TypeError):
        return BlockwalkError(error.code, error.reason)


def _array(data, kind, shape):
    try:
        import numpy
    except ImportError:
        return memoryview(data).cast("B").cast(_NUMPY_CODES[kind], shape)
    return numpy.frombuffer(data, kind).reshape(shape)


def _npy(data):
    """The array of a NumPy file, of the types that the server has (numpy.org/neps/nep-0001-npy-format.html)."""
    if data[:8] != b"\x93NUMPY\x01\x00":
        raise BlockwalkError(200, "the reply is no NumPy file of version 1")
    (length,) = struct.unpack_from("<H", data, 8)
    header = ast.literal_eval(data[10:10 + length].decode("latin1").strip())
    return _array(data[10 + length:], header["descr"], header["shape"])
