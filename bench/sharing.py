# SPDX-License-Identifier: Apache-2.0
"""One honest viewer of a daemon beside those who ask for all they can get: what is left to it.

    bench/sharing.py build/release/blockwalkd FILE.bwv [--seconds 20] [--only NAME...] [--format png] [--json OUT]

The viewer is a stream that acknowledges and whose view always changes. Its target rate is more than the device can
hold, so that its frames have the smallest scale whatever happens and its rate is its share of the device; its size is
searched for until it has --rate frames a second alone. Then, in turns: alone, beside one crowd, alone, beside the next.
What a crowd leaves is compared with the mean of the times alone before and after it, so that other work on the machine
weighs on both.

Loopback has many addresses, and a peer is one of them: "others" are of one other address than the viewer, "same" of the
viewer's own, where a stream and all requests together are even shares. The fair share is half of the device in both.
The rows "slow readers" and "silent" measure what those hold up who take no device time: there the share is all of it,
and a stranger's small picture and /healthz are timed too. Exits with 1 where a bar is missed (`judge`).
"""
import argparse
import http.client
import json
import multiprocessing
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

BAND_S = 0.025
VIEWER = "127.0.0.1"
OTHERS = "127.0.0.2"
STRANGER = "127.0.0.3"


def options():
    parser = argparse.ArgumentParser()
    parser.add_argument("daemon")
    parser.add_argument("volume")
    parser.add_argument("--seconds", type=float, default=20, help="of each turn")
    parser.add_argument("--rate", type=float, default=10, help="frames a second that the viewer is to have alone")
    parser.add_argument("--only", nargs="*", help="rows whose name begins so")
    parser.add_argument("--format", default="png", help="of the crowd's pictures")
    parser.add_argument("--json", help="the rows, one a line, into this file")
    return parser.parse_args()


# ---- The viewer ----


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


class Viewer:
    """Frames as they come, on a thread; views on another, 30 a second."""

    def __init__(self, port, volume):
        self.stream = Stream(VIEWER, port, volume)
        self.size = [1024, 768]
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
            angle = 0.02 * number
            message = {"type": "view", "id": number, "size": self.size, "fov": 40 + 2 * abs((angle % 2) - 1),
                       "filter": "linear"}
            try:
                with self.lock:
                    self.stream.send_json(message)
            except OSError as error:
                self.failure = error
                return
            time.sleep(1 / 30)

    def receive(self):
        try:
            while not self.ended:
                kind, payload = self.stream.read()
                if kind == 1:
                    message = json.loads(payload)
                    if message["type"] == "error":
                        raise ConnectionError(message["problem"]["detail"])
                    continue
                length = struct.unpack("<I", payload[:4])[0]
                header = json.loads(payload[4:4 + length])
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


# ---- The crowds ----


def image_request(volume, size, number, form, fov):
    return (f"GET /api/v1/volumes/{volume}/image?size={size}&fov={fov + number % 97 / 10}&filter=linear&format={form} HTTP/1.1\r\n"
            "Host: localhost\r\n\r\n").encode()


def read_reply(connection, buffer, rate=None):
    """Throws the body away, at most `rate` bytes a second of it. The status; 0 where the connection was closed."""
    head = b""
    while b"\r\n\r\n" not in head:
        data = connection.recv(4096)
        if not data:
            return 0
        head += data
    head, body = head.split(b"\r\n\r\n", 1)
    status = int(head[9:12])
    length = re.search(rb"(?i)content-length: (\d+)", head)
    left = int(length[1]) - len(body) if length else 0
    while left > 0:
        count = connection.recv_into(buffer, min(left, len(buffer), int(rate) if rate else left))
        if count == 0:
            return 0
        left -= count
        if rate:
            time.sleep(count / rate)
    return status


def ask_for_ever(port, address, volume, crowd, size, form, number, statuses):
    keep_alive, rate, fov = crowd.get("keep_alive", False), crowd.get("rate"), crowd.get("fov", 30)
    buffer = bytearray(1 << 20)
    connection = None
    while True:
        try:
            if connection is None:
                connection = socket.socket()
                if rate:
                    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
                connection.bind((address, 0))
                connection.connect(("127.0.0.1", port))
            connection.sendall(image_request(volume, size, number, form, fov))
            number += 101
            status = read_reply(connection, buffer, rate)
            statuses[status] = statuses.get(status, 0) + 1
            if status == 200 and keep_alive:
                continue
            if status != 200:
                time.sleep(0.05)
        except OSError:
            statuses["lost"] = statuses.get("lost", 0) + 1
            time.sleep(0.05)
        if connection is not None:
            connection.close()
        connection = None


def be_silent(port, address, count, kept):
    for _ in range(count):
        connection = socket.create_connection(("127.0.0.1", port), source_address=(address, 0))
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        connection.recv(4096)
        kept.append(connection)


def run_crowd(crowd, port, address, volume, form, report):
    """In a process of its own, so that the viewer's reading is not what is measured."""
    statuses, kept = {}, []
    signal.signal(signal.SIGTERM, lambda *_: (report.put({str(k): v for k, v in statuses.items()}), os._exit(0)))
    if "silent" in crowd:
        be_silent(port, address, crowd["silent"], kept)
    for number in range(crowd.get("count", 0)):
        size = crowd["size"] if isinstance(crowd["size"], str) else crowd["size"][number]
        threading.Thread(target=ask_for_ever, daemon=True,
                         args=(port, address, volume, crowd, size, crowd.get("form", form), number, statuses)).start()
    while True:
        signal.pause()


CROWDS = [
    {"name": "one hog, 8192x8192, one connection", "count": 1, "size": "8192x8192", "keep_alive": True},
    {"name": "4 loops of 2048x2048", "count": 4, "size": "2048x2048"},
    {"name": "32 loops of 512x512", "count": 32, "size": "512x512"},
    {"name": "64 at once of 8192x8192", "count": 64, "size": "8192x8192", "keep_alive": True},
    {"name": "2 loops of 256x256", "count": 2, "size": "256x256"},
]
IDLE_CROWDS = [
    {"name": "slow readers, 6 at 14 kB/s, raw", "count": 6, "form": "raw", "rate": 14000, "fov": 165,
     "size": ["8192x8192", "8192x8192", "8192x8192", "7000x7000", "4096x4096", "2048x2048"]},
    {"name": "silent, 512 connections", "silent": 512},
]


# ---- The stranger, for whom the server must not be deaf ----


def stranger(port, volume, report, seconds):
    """The slowest /healthz and the slowest small picture, each on a connection of its own."""
    slowest = {"healthz_s": 0.0, "picture_s": 0.0, "wrong": 0}
    end = time.monotonic() + seconds
    number = 0
    while time.monotonic() < end:
        number += 1
        for name, target in (("healthz_s", "/healthz"),
                             ("picture_s", f"/api/v1/volumes/{volume}/image?size=64x64&fov={20 + number % 97}")):
            begin = time.monotonic()
            try:
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60, source_address=(STRANGER, 0))
                connection.request("GET", target)
                reply = connection.getresponse()
                reply.read()
                connection.close()
                slowest["wrong"] += reply.status != 200
            except (OSError, http.client.HTTPException):
                slowest["wrong"] += 1
            slowest[name] = max(slowest[name], time.monotonic() - begin)
        time.sleep(0.5)
    report.update(slowest)


# ---- The programme ----


def judge(row):
    """The bars that a row misses: 9/10 of its fair share, in frames and in device time; the longest gap; the 95th
    percentile of frame times. Where other work is on the machine, which is not of the daemon's sharing, frames suffer
    and device time tells."""
    missed = []
    share = 1 if row["idle"] else 0.5
    if row["ratio"] < 0.9 * share:
        missed.append("frames")
    if not row["idle"] and row["device"] < 0.9 * share * row["alone_device"]:
        missed.append("share")
    if row["longest_gap_s"] >= 0.5:
        missed.append("gap")
    if row["p95_s"] > 2 * row["alone_p95_s"] + BAND_S:  # beside idle ones, too: the stranger has its turns
        missed.append("p95")
    if row["idle"] and (row["healthz_s"] > 0.5 or row["picture_s"] > 1 or row["wrong"]):
        missed.append("stranger")
    return missed


def metric(port, name):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request("GET", "/metrics")
    found = re.search(rf"^blockwalk_{name} (\S+)$", connection.getresponse().read().decode(), re.MULTILINE)
    return float(found[1])


def start_daemon(asked):
    daemon = subprocess.Popen([asked.daemon, "--listen", "127.0.0.1:0", asked.volume], stdout=subprocess.PIPE, text=True)
    for line in daemon.stdout:
        found = re.search(r"listening on http://127\.0\.0\.1:(\d+)/", line)
        if found:
            threading.Thread(target=daemon.stdout.read, daemon=True).start()  # its log must not fill the pipe
            return daemon, int(found[1])
    raise SystemExit("the daemon ended before it listened")


def volume_id(port):
    while True:
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        connection.request("GET", "/readyz")
        reply = connection.getresponse()
        if reply.status == 200:
            return next(iter(json.loads(reply.read())["volumes"]))
        time.sleep(0.2)


def calibrate(viewer, rate):
    """Sets the viewer's size to what it has about `rate` frames a second of, at an eighth of the side."""
    for _ in range(6):
        got = viewer.measure(4)
        if got["scales"] == [0.125] and 0.9 <= got["fps"] / rate <= 1.1:
            break
        grow = min(max((got["fps"] / rate) ** 0.5, 0.5), 2) if got["fps"] else 0.5
        viewer.size = [max(256, min(8192, round(side * grow))) for side in viewer.size]
    print(f"viewer: {viewer.size[0]}x{viewer.size[1]} at 1/8", flush=True)


def wait_until_idle(viewer, alone_device):
    """Until what the crowd asked for is drawn and only its reading is left; or for two minutes."""
    end = time.monotonic() + 120
    while time.monotonic() < end and viewer.measure(3)["device"] < 0.9 * alone_device:
        pass


def wait_until_idle(viewer, alone_device):
    """Until what the crowd asked for is drawn and only its reading is left; or for two minutes."""
    end = time.monotonic() + 120
    while time.monotonic() < end and viewer.measure(3)["device"] < 0.9 * alone_device:
        pass


def main():
    asked = options()
    if asked.json:
        open(asked.json, "w").close()
    daemon, port = start_daemon(asked)
    crowds = []
    failed = False
    try:
        volume = volume_id(port)
        viewer = Viewer(port, volume)
        viewer.measure(8)  # its kernel is made, and it has found its scale
        calibrate(viewer, asked.rate)
        rows = [(crowd, where) for crowd in CROWDS for where in ("others", "same")] + [(c, "others") for c in IDLE_CROWDS]
        if asked.only:
            rows = [row for row in rows if any(row[0]["name"].startswith(name) for name in asked.only)]
        print(f"{'crowd':36} {'of':7} {'alone':>5} {'beside':>6} {'ratio':>5} {'gap s':>6} {'p95 ms':>12} {'device':>6}")
        before = viewer.measure(asked.seconds)
        for crowd, where in rows:
            address = VIEWER if where == "same" else OTHERS
            report = multiprocessing.SimpleQueue()
            process = multiprocessing.Process(target=run_crowd, daemon=True,
                                              args=(crowd, port, address, volume, asked.format, report))
            process.start()
            crowds.append(process)
            time.sleep(3)
            if crowd in IDLE_CROWDS:
                wait_until_idle(viewer, before["device"])
            asking, about = None, {}
            if crowd in IDLE_CROWDS:
                asking = threading.Thread(target=stranger, args=(port, volume, about, asked.seconds))
                asking.start()
            frames = metric(port, "frames_total")
            beside = viewer.measure(asked.seconds)
            frames = metric(port, "frames_total") - frames - beside["fps"] * asked.seconds
            if asking:
                asking.join()
            process.terminate()
            statuses = report.get()
            process.join()
            time.sleep(3)  # what was under way ends
            after = viewer.measure(asked.seconds)
            alone_fps = (before["fps"] + after["fps"]) / 2
            row = {"crowd": crowd["name"], "of": where, "idle": crowd in IDLE_CROWDS, "alone_fps": alone_fps,
                   "alone_p95_s": (before["p95_s"] + after["p95_s"]) / 2,
                   "alone_gap_s": max(before["longest_gap_s"], after["longest_gap_s"]),
                   "alone_device": (before["device"] + after["device"]) / 2,
                   **beside, **about, "ratio": beside["fps"] / alone_fps, "replies": statuses, "crowd_frames": frames}
            missed = judge(row)
            failed = failed or bool(missed)
            told = f"  healthz {1000 * about['healthz_s']:.0f} ms, picture {1000 * about['picture_s']:.0f} ms" if about else ""
            print(f"{row['crowd']:36} {where:7} {alone_fps:5.1f} {row['fps']:6.1f} {row['ratio']:5.2f} "
                  f"{row['longest_gap_s']:6.2f} {1000 * row['alone_p95_s']:5.0f} {1000 * row['p95_s']:6.0f} "
                  f"{row['device'] / row['alone_device']:6.2f}{told}  replies {statuses}  "
                  f"{'missed: ' + ', '.join(missed) if missed else 'met'}", flush=True)
            if asked.json:
                with open(asked.json, "a") as out:
                    print(json.dumps(row | {"missed": missed}), file=out)
            before = after
        viewer.ended = True
        print("alive" if daemon.poll() is None else f"ended with {daemon.returncode}", "and", "missed" if failed else "met")
        return 1 if failed or daemon.poll() is not None else 0
    finally:
        for process in crowds:
            if process.is_alive():
                process.kill()
        daemon.send_signal(signal.SIGTERM)
        try:
            daemon.wait(timeout=30)
        except subprocess.TimeoutExpired:
            daemon.kill()


if __name__ == "__main__":
    sys.exit(main())
