# SPDX-License-Identifier: Apache-2.0
"""A viewer of a stream that acknowledges every frame and whose view always changes: what comes, and when."""
import json
import socket
import struct
import threading
import time


class Stream:
    """A WebSocket of subprotocol blockwalk.v1 that masks with zeros."""

    def __init__(self, address, port, volume):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60, source_address=(address, 0))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.rest = b""
        self.socket.sendall(
            (f"GET /api/v1/volumes/{volume}/stream HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
             "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
             "Sec-WebSocket-Protocol: blockwalk.v1\r\n\r\n").encode())
        while b"\r\n\r\n" not in self.rest:
            self.rest += self.more()
        head, self.rest = self.rest.split(b"\r\n\r\n", 1)
        if not head.startswith(b"HTTP/1.1 101"):
            raise SystemExit(f"no stream: {head.splitlines()[0].decode()}")

    def more(self):
        data = self.socket.recv(1 << 20)
        if not data:
            raise ConnectionError("the stream was closed")
        return data

    def take(self, count):
        while len(self.rest) < count:
            self.rest += self.more()
        taken, self.rest = self.rest[:count], self.rest[count:]
        return taken

    def send(self, opcode, payload):
        length = len(payload)
        head = bytes([0x80 | opcode, 0x80 | length]) if length < 126 else bytes([0x80 | opcode, 0xFE]) + struct.pack(
            ">H", length)
        self.socket.sendall(head + bytes(4) + payload)

    def send_json(self, message):
        self.send(1, json.dumps(message).encode())

    def read(self):
        """The next message, from its fragments."""
        payload, kind = b"", 0
        while True:
            first, second = self.take(2)
            length = second & 0x7F
            if length == 126:
                length = struct.unpack(">H", self.take(2))[0]
            elif length == 127:
                length = struct.unpack(">Q", self.take(8))[0]
            part = self.take(length)
            if first & 0x0F == 9:
                self.send(10, part)
                continue
            if first & 0x0F in (8, 10):
                if first & 0x0F == 8:
                    raise ConnectionError(f"the stream was closed with {part[:2].hex()}")
                continue
            kind = kind or first & 0x0F
            payload += part
            if first & 0x80:
                return kind, payload

    def read_frame(self):
        """The header of the next frame."""
        return self.read_picture()[0]

    def read_picture(self):
        """Header and bytes of the next frame. Other texts are passed by; an error of the server's is one here."""
        while True:
            kind, payload = self.read()
            if kind != 1:
                length = struct.unpack("<I", payload[:4])[0]
                return json.loads(payload[4:4 + length]), payload[4 + length:]
            message = json.loads(payload)
            if message["type"] == "error":
                raise ConnectionError(message["problem"]["detail"])


class Viewer:
    """Frames as they come, on a thread; views on another, so many a second."""

    def __init__(self, address, port, volume, views_a_second=30, size=(1024, 768), filter_name="linear"):
        self.stream = Stream(address, port, volume)
        self.pause = 1 / views_a_second
        self.size = list(size)
        self.filter = filter_name
        self.arrivals = []  # (time, header)
        self.failure = None
        self.ended = False
        self.lock = threading.Lock()
        self.stream.send_json({"type": "limits", "fps": 120})
        threading.Thread(target=self.look, daemon=True).start()
        threading.Thread(target=self.receive, daemon=True).start()

    def look(self):
        number = 0
        while not self.ended:
            number += 1
            angle = 0.6 * number * self.pause
            message = {"type": "view", "id": number, "size": self.size, "fov": 40 + 2 * abs((angle % 2) - 1),
                       "filter": self.filter}
            try:
                with self.lock:
                    self.stream.send_json(message)
            except OSError as error:
                self.failure = error
                return
            time.sleep(self.pause)

    def receive(self):
        try:
            while not self.ended:
                header = self.stream.read_frame()
                self.arrivals.append((time.monotonic(), header))
                with self.lock:
                    self.stream.send_json({"type": "ack", "id": header["id"]})
        except (OSError, ConnectionError) as error:
            self.failure = error

    def measure(self, seconds):
        """What came in the next seconds."""
        begin = time.monotonic()
        first = len(self.arrivals)
        time.sleep(seconds)
        end = time.monotonic()
        if self.failure:
            raise SystemExit(f"the viewer: {self.failure}")
        frames = self.arrivals[max(first - 1, 0):]
        times = [at for at, _ in frames if at <= end]
        # The wait for a first or a last frame is a gap too.
        gaps = sorted([b - a for a, b in zip(times, times[1:])] + [end - (times[-1] if times else begin)])
        headers = [header for at, header in frames if begin <= at <= end]
        return {
            "fps": len(headers) / (end - begin),
            "longest_gap_s": gaps[-1],
            "p95_s": gaps[int(0.95 * (len(gaps) - 1))],
            "device": sum(header["gpu_ms"] for header in headers) / 1000 / (end - begin),
            "scales": sorted({header["scale"] for header in headers}),
        }
