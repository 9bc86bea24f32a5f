# SPDX-License-Identifier: Apache-2.0
"""A daemon of the programmes beside this file: started on a port of its own, asked over HTTP, and ended with them."""
import http.client
import json
import re
import signal
import subprocess
import threading
import time


class Daemon:
    def __init__(self, program, *arguments, environment=None):
        self.process = subprocess.Popen([program, "--listen", "127.0.0.1:0", *arguments], stdout=subprocess.PIPE, text=True,
                                        env=environment)
        self.pid = self.process.pid
        self.port = self._port()

    def _port(self):
        for line in self.process.stdout:
            found = re.search(r"listening on http://127\.0\.0\.1:(\d+)/", line)
            if found:
                threading.Thread(target=self.process.stdout.read, daemon=True).start()  # its log must not fill the pipe
                return int(found[1])
        raise SystemExit("the daemon ended before it listened")

    def get(self, target):
        """Status and body."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=300)
        try:
            connection.request("GET", target)
            reply = connection.getresponse()
            return reply.status, reply.read()
        finally:
            connection.close()

    def volumes(self):
        """Their names, once all that can be served is."""
        while True:
            status, body = self.get("/readyz")
            if status == 200:
                return list(json.loads(body)["volumes"])
            time.sleep(0.2)

    def metric(self, name):
        return float(re.search(rf"^blockwalk_{name} (\S+)$", self.get("/metrics")[1].decode(), re.MULTILINE)[1])

    def is_alive(self):
        return self.process.poll() is None

    def verdict(self, failed):
        """Prints it. The exit status of a programme."""
        state = "alive" if self.is_alive() else f"ended with {self.process.returncode}"
        print(state, "and", "missed" if failed else "met")
        return 1 if failed or not self.is_alive() else 0

    def end(self):
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(timeout=30)
        except subprocess.TimeoutExpired:
            self.process.kill()
