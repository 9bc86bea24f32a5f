#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The Python client with a real daemon: what it gets is what the command line makes. BLOCKWALK_BIN has the programs."""
import io
import os
import subprocess
import sys
import tempfile
import unittest
import zipfile

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "..", "clients", "python"))
import blockwalk  # noqa: E402

BIN = os.environ["BLOCKWALK_BIN"]
TOKEN = "s3cret-s3cret-s3cret-s3cret"


def run(*arguments):
    subprocess.run([os.path.join(BIN, "blockwalk"), *map(str, arguments)], check=True, capture_output=True)


class Client(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.file = os.path.join(cls.folder.name, "cells.bwv")
        run("demo", "cells", "-o", cls.file, "--size", 64)
        token = os.path.join(cls.folder.name, "token")
        with open(token, "w", encoding="ascii") as file:
            file.write(TOKEN)
        cls.daemon = subprocess.Popen([os.path.join(BIN, "blockwalkd"), "--listen", "127.0.0.1:0", "--token-file", token,
                                       cls.file], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        cls.url = next(line.split()[-1] for line in cls.daemon.stdout if "listening on" in line)
        cls.server = blockwalk.Server(cls.url, token=TOKEN)
        while cls.server.volumes()[0]["state"] == "loading":
            pass
        cls.cells = cls.server.volume("cells")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.terminate()
        cls.daemon.wait()
        cls.daemon.stdout.close()
        cls.folder.cleanup()

    def made(self, name, *arguments):
        path = os.path.join(self.folder.name, name)
        run(arguments[0], self.file, "-o", path, *arguments[1:])
        with open(path, "rb") as file:
            return file.read()

    def test_lists_volumes(self):
        self.assertEqual([volume["id"] for volume in self.server.volumes()], ["cells"])
        self.assertEqual(self.cells.info()["dims"], [64, 48, 32])
        self.assertIn("name", self.server.device())

    def test_pictures(self):
        picture = self.cells.image(size=(40, 30), mode="mip", lit=False, range=[(1, 60000)])
        self.assertEqual(picture.type, "image/png")
        self.assertEqual(picture.data[:4], b"\x89PNG")
        self.assertEqual(picture.info["rays"], 1200)
        self.assertEqual(picture._repr_mimebundle_(), {"image/png": picture.data})
        pixels = self.cells.image(size=(40, 30), format="raw")
        self.assertEqual(tuple(pixels.shape), (30, 40, 4))
        depth = self.cells.image(size=(40, 30), format="raw", output="depth", mode="first-hit")
        self.assertEqual(tuple(depth.shape), (30, 40))

    def test_a_picture_by_a_deadline(self):
        whole = self.cells.image(size=(40, 30), mode="mip", tf_shape="stepped")
        timely = self.cells.image(size=(40, 30), mode="mip", tf_shape="stepped", deadline_ms=60000)
        self.assertEqual((timely.info["final"], timely.info["scale"]), (True, 1))
        self.assertEqual(timely.data, whole.data)
        with self.assertRaisesRegex(blockwalk.BlockwalkError, "deadline_ms"):
            self.cells.image(size=(40, 30), deadline_ms=0)

    def test_animations(self):
        view = {"mode": "mip", "fov": 30}
        film = self.cells.animate(frames=3, size=(40, 30), view=view, turntable={"seconds": 1})
        self.assertEqual((film.type, film.info), ("application/zip", {"frames": 3, "fps": 3.0}))
        with zipfile.ZipFile(io.BytesIO(film.data)) as frames:
            self.assertIsNone(frames.testzip())
            self.assertEqual(frames.namelist(), ["frame0000.png", "frame0001.png", "frame0002.png"])
            self.assertEqual(frames.read("frame0000.png"), self.cells.image(size=(40, 30), **view).data)
            self.assertNotEqual(frames.read("frame0001.png"), frames.read("frame0000.png"))
        path = os.path.join(self.folder.name, "film.webp")
        keys = [{"seconds": 0}, {"seconds": 1, "view": {"fov": 20}}]
        self.assertEqual(self.cells.animate(save=path, keys=keys, fps=4, size=[40, 30], format="webp")["frames"], 5)
        with open(path, "rb") as file:
            self.assertEqual(file.read(4), b"RIFF")
        self.assertFalse(os.path.exists(path + ".partial"))
        with self.assertRaises(blockwalk.BlockwalkError) as refused:
            self.cells.animate(frames=0)
        self.assertEqual((refused.exception.status, refused.exception.field), (400, "frames"))

    def test_slices(self):
        self.assertEqual(self.cells.slice(axis="z", index=20).data, self.made("s.png", "slice", "--axis", "z", "--index", 20))
        values = self.cells.slice(axis="y", index=20, thickness=5, reduce="mean", box=(1, 2, 3, 40, 41, 31), format="npy")
        self.assertEqual(tuple(values.shape), (28, 39))
        made = self.made("s.npy", "slice", "--axis", "y", "--index", 20, "--thickness", 5, "--reduce", "mean", "--box",
                         "1,2,3,40,41,31")
        self.assertEqual(values.tobytes(), made[-28 * 39 * 2:])
        said = self.cells.slice(centre=(32, 32, 32), right=(1, 1, 0), down=(0, 0, 1), pixel=0.5, size=(20, 10)).info
        self.assertEqual((said["width"], said["height"], said["level"]), (20, 10, 0))

    def test_regions(self):
        voxels = self.cells.region(box=(0, 1, 2, 10, 21, 32))
        self.assertEqual(tuple(voxels.shape), (30, 20, 10))
        made = self.made("r.npy", "export", "--box", "0,1,2,10,21,32")
        self.assertEqual(voxels.tobytes(), made[-30 * 20 * 10 * 2:])
        self.assertEqual(voxels[5, 6, 7], self.cells.slice(axis="z", index=7, format="npy")[7, 7])

    def test_does_without_numpy(self):
        with_numpy = self.cells.region(box=(0, 0, 0, 9, 8, 7))
        known = sys.modules.get("numpy")
        sys.modules["numpy"] = None  # as where it is not installed
        try:
            voxels = self.cells.region(box=(0, 0, 0, 9, 8, 7))
        finally:
            del sys.modules["numpy"]
            if known is not None:
                sys.modules["numpy"] = known
        self.assertIsInstance(voxels, memoryview)
        self.assertEqual(voxels.shape, (7, 8, 9))
        self.assertEqual(voxels.tobytes(), with_numpy.tobytes())

    def test_picks(self):
        said = self.cells.pick(x=20, y=15, size=(40, 30), mode="mip")
        self.assertIn("hit", said)
        self.assertFalse(self.cells.pick(x=0, y=0, size=(400, 300), mode="first-hit")["hit"])
        self.assertFalse(self.cells.explain(size=(40, 30))["empty"])

    def test_says_what_is_refused(self):
        with self.assertRaises(blockwalk.BlockwalkError) as refused:
            self.cells.slice(axis="z", index=64)
        self.assertEqual((refused.exception.status, refused.exception.field), (400, "index"))
        with self.assertRaises(blockwalk.BlockwalkError) as refused:
            self.server.volume("a/b c").info()
        self.assertEqual(refused.exception.status, 404)
        with self.assertRaises(blockwalk.BlockwalkError) as refused:
            blockwalk.Server(self.url, token="wrong").volumes()
        self.assertEqual(refused.exception.status, 401)
        with self.assertRaises(ValueError):
            blockwalk.Server("127.0.0.1:8080")
        with self.assertRaises(TypeError):
            self.cells.region(format="nrrd")

    def test_takes_its_token_from_the_environment(self):
        os.environ["BLOCKWALK_TOKEN"] = TOKEN
        try:
            self.assertEqual(len(blockwalk.Server(self.url).volumes()), 1)
        finally:
            del os.environ["BLOCKWALK_TOKEN"]


if __name__ == "__main__":
    unittest.main()
