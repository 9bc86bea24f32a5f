# SPDX-License-Identifier: Apache-2.0
"""Those who ask a daemon for all they can get, each crowd in a process of its own, and a stranger beside them."""
import http.client
import os
import re
import signal
import socket
import threading
import time


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


def stranger(port, address, volume, report, seconds):
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
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60, source_address=(address, 0))
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
