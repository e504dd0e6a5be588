"""halflightd called by an independent client: what comes back is what the C++ client gets.

    interop_test.py CLIENT BIN [NODE_FOLDER]    CLIENT is python or node, BIN has the programs

NODE_FOLDER has the client for Node beside its node_modules. Files are compared byte for byte.
"""

import base64
import hashlib
import json
import pathlib
import re
import sys
import tempfile
import time
import unittest

from programs import HERE, ROOT, Programs, plume, said_by, wait_for
from relay import CutAfter, FlipOnce, Relay

sys.path.insert(0, str(HERE / "python"))
import halflight  # noqa: E402  the client for Python, to ask servers what the others did

NAMES = {"BEAUTY": "beauty", "COVERAGE": "coverage", "DEPTH": "depth", "LIGHT_BUFFER": "light",
         "LIGHT_TRANSMITTANCE": "transmittance"}
EXTENSIONS = {"PNG": ".png", "EXR": ".exr", "RAW": ".raw"}


class Interop(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.address = self.enterContext(halflightd(self.folder))

    def request(self, name, *flags, ply=plume(40)):
        """The request of a file, completed by the C++ client: its path, and flags for outputs."""
        source = HERE / f"requests/{name}.json"
        outputs = []
        for output in json.loads(source.read_text())["outputs"]:
            kind = NAMES[output["kind"].removeprefix("OUTPUT_KIND_")]
            outputs.append((kind, kind + EXTENSIONS[output["format"].split("_")[2][:3]]))
        common = [ply, "--scene", source, *flags]
        printed = cpp_client(*common, *self.to(outputs), "--print-scene")
        self.assertEqual(printed.stderr, "")
        path = self.folder / f"{name}.json"
        path.write_text(printed.stdout)
        return path, common, outputs

    @staticmethod
    def to(outputs, folder=pathlib.Path(), pattern=""):
        return [word for kind, path in outputs
                for word in ("-o", f"{kind}={folder / (pattern + path)}")]

    def cpp_files(self, common, outputs, address=None):
        rendered = cpp_client(*common, *self.to(outputs, self.folder / "cpp"),
                              "--server", address or self.address)
        self.assertEqual(rendered.stderr, "")
        return [(self.folder / "cpp" / path).read_bytes() for _, path in outputs]

    def client_files(self, request, outputs):
        paths = [self.folder / path for _, path in outputs]
        header = call_client(self.address, "render", request, *paths)
        self.assertIn("metadata", header)
        return [path.read_bytes() for path in paths], header

    def expect_equal(self, expected, got):
        self.assertEqual([hashlib.sha256(each).hexdigest() for each in expected],
                         [hashlib.sha256(each).hexdigest() for each in got])
        self.assertTrue(all(len(each) > 1000 for each in expected))

    def test_manual_shows_the_code_of_the_clients(self):
        """docs/clients.md: the lines of each block stand in one of the files, but for indents."""
        def lines_of(text):
            return [line.strip() for line in text.splitlines() if line.strip()]
        sources = ["\n".join(lines_of(path.read_text()))
                   for path in [*HERE.glob("python/*.py"), *HERE.glob("node/*.mjs")]]
        blocks = re.findall(r"^```\w+\n(.*?)^```$", (ROOT / "docs/clients.md").read_text(),
                            re.DOTALL | re.MULTILINE)
        self.assertGreater(len(blocks), 5)
        for block in blocks:
            wanted = "\n".join(lines_of(block))
            self.assertTrue(any(wanted in source for source in sources), block)

    def test_server_says_it_is_well(self):
        self.assertEqual(call_client(self.address, "health"), {"status": "SERVING"})

    def test_set_has_the_same_name_as_from_cpp_and_is_sent_once(self):
        request, common, outputs = self.request("half_angle")
        name = base64.b64decode(
            json.loads(request.read_text())["scene"]["particle_sha256"]).hex()
        self.assertEqual(call_client(self.address, "upload", plume(40)),
                         {"offsets": [[0]], "sha256": [name]})
        self.assertEqual(call_client(self.address, "upload", plume(40)),
                         {"offsets": [], "sha256": [name]})
        # What C++ has uploaded is not missing either.
        self.cpp_files([plume(32), *common[1:]], outputs)
        self.assertEqual(call_client(self.address, "upload", plume(24), plume(32))["offsets"], [[0]])

    def test_files_are_those_of_cpp(self):
        call_client(self.address, "upload", plume(40))
        for name in ("half_angle", "light_sweep", "measured_error"):
            with self.subTest(name):
                request, common, outputs = self.request(name)
                files, header = self.client_files(request, outputs)
                self.expect_equal(self.cpp_files(common, outputs), files)
                self.assertEqual(bool(header.get("error")), name == "measured_error")

    def test_another_request_gives_other_files(self):
        request, common, outputs = self.request("half_angle")
        expected = self.cpp_files(common, outputs)
        other = json.loads(request.read_text())
        other["scene"]["material"]["opacity"] += 0.001
        request.write_text(json.dumps(other))
        files, _ = self.client_files(request, outputs)
        for one, another in zip(expected, files, strict=True):
            self.assertNotEqual(one, another)

    def test_sequence_is_that_of_cpp(self):
        frames = (24, 32, 40)
        request, common, outputs = self.request("sequence", ply=plume(24))
        rendered = cpp_client(
            ROOT / "tests/data/plume/plume.%04d.ply", *common[1:], "--frames", "24-40x8",
            *self.to(outputs, self.folder / "cpp", "%04d."), "--server", self.address)
        self.assertEqual(rendered.stderr, "")
        names = [f"{frame:04}.{path}" for frame in frames for _, path in outputs]
        said = call_client(self.address, "sequence", request, len(frames), *map(plume, frames),
                           *[self.folder / name for name in names])
        self.assertEqual(len(said["frames"]), 3)
        files = [(self.folder / name).read_bytes() for name in names]
        self.expect_equal([(self.folder / "cpp" / name).read_bytes() for name in names], files)
        self.assertEqual(len(set(files)), len(files))

    def test_errors_say_what_is_wrong_to_programs(self):
        call_client(self.address, "upload", plume(40))
        request, _, _ = self.request("half_angle")
        for field, value, reason, allowed in (
                ("scene.material.opacity", 1.5, "INVALID_FIELD", "[0, 1]"),
                ("scene.shadow.slices", 65537, "LIMIT_EXCEEDED", "[1, 65536]")):
            wrong = json.loads(request.read_text())
            group, _, last = field.removeprefix("scene.").partition(".")
            wrong["scene"][group][last] = value
            path = self.folder / "wrong.json"
            path.write_text(json.dumps(wrong))
            said = call_client(self.address, "render", path)
            self.assertEqual(said["code"], "INVALID_ARGUMENT")
            self.assertEqual(said["details"], {"field": field, "value": str(value),
                                               "reason": reason, "allowed": allowed})
        # Nothing was uploaded to this one.
        elsewhere = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        with halflightd(elsewhere) as address:
            said = call_client(address, "render", request)
        self.assertEqual(said["code"], "NOT_FOUND")
        self.assertEqual(said["details"]["reason"], "PARTICLES_NOT_FOUND")

    def test_frame_that_is_cancelled_ends(self):
        call_client(self.address, "upload", plume(40))
        request, common, outputs = self.request(
            "half_angle", "--technique", "reference", "--size", "1280x960", "--supersample", "2",
            "--request-id", "unwanted")  # minutes
        client = start_client(self.address, "cancel", request)
        time.sleep(1)
        self.assertEqual(said_by(client)["code"], "CANCELLED")
        self.assertTrue(wait_for(lambda: any(
            b"request_id=unwanted " in line and b"outcome=CANCELLED" in line
            for line in (self.folder / "log").read_bytes().splitlines())))
        request, common, outputs = self.request("half_angle")
        self.expect_equal(self.cpp_files(common, outputs), self.client_files(request, outputs)[0])

    def upload_broken_off(self, hooks_for=lambda payload: []):
        """Of an upload whose connection broke: the set, what was kept, the offsets of the tries."""
        client = halflight.Client(self.address)
        # gRPC drops messages that have arrived but that the server had no time to take before the
        # connection broke, so on a busy machine there may be nothing that is kept.
        for frame, pause_s in ((24, 0.2), (32, 2), (40, 20)):
            particles = halflight.read_ply(plume(frame))
            query = client.new("QueryUploadRequest", sha256=particles.sha256)
            kept = 0

            def is_kept():
                nonlocal kept
                kept = client.service.QueryUpload(query, timeout=30).committed_bytes
                return kept > 0
            with Relay(self.folder / "socket", to_server=[
                    *hooks_for(particles.payload),
                    CutAfter(600_000, pause_s, lambda: wait_for(is_kept, 5))]) as relay:
                (offsets,) = call_client(relay.address, "upload", plume(frame))["offsets"]
            if kept > 0:
                return plume(frame), kept, offsets
            self.assertEqual(offsets, [0, 0])
        self.fail("nothing was kept in any of three tries")

    def expect_whole(self, ply):
        """A set that is not what its name says would give another picture."""
        request, common, outputs = self.request("half_angle", ply=ply)
        with tempfile.TemporaryDirectory() as other, halflightd(pathlib.Path(other)) as address:
            expected = self.cpp_files(common, outputs, address)
        self.expect_equal(expected, self.client_files(request, outputs)[0])

    def test_upload_goes_on_where_the_connection_broke(self):
        ply, kept, offsets = self.upload_broken_off()
        self.assertEqual(offsets, [0, kept])
        self.expect_whole(ply)

    def test_upload_that_goes_on_from_damaged_bytes_is_noticed(self):
        ply, kept, offsets = self.upload_broken_off(
            lambda payload: [FlipOnce(payload[50_000:200_000])])
        self.assertEqual(offsets, [0, kept, 0])
        self.expect_whole(ply)

    def test_frame_that_is_damaged_on_the_way_is_noticed(self):
        call_client(self.address, "upload", plume(40))
        request, common, outputs = self.request("half_angle")
        (image, *_) = self.cpp_files(common, outputs)

        def through_relay(call):
            flip = FlipOnce(image[1000:-1000])
            with Relay(self.folder / "socket", to_client=[flip]) as relay:
                said = call(relay.address)
            self.assertTrue(flip.done)
            return said
        files = [self.folder / path for _, path in outputs]
        said = through_relay(lambda address: call_client(address, "render", request, *files))
        self.assertEqual(said, {"damaged": "output 0: size or CRC-32C is not as promised"})
        self.assertFalse(any(path.exists() for path in files))
        said = through_relay(lambda address: cpp_client(
            *common, *self.to(outputs, self.folder / "damaged"), "--server", address))
        self.assertIn("output 0: CRC-32C", said.stderr)

    def test_token_says_who_calls(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        digest = hashlib.sha256(b"open sesame").hexdigest()
        (folder / "tokens").write_text(f"{digest} alice\n")
        with halflightd(folder, "--token-file", folder / "tokens") as address:
            said = call_client(address, "upload", plume(24))
            self.assertEqual(said["code"], "UNAUTHENTICATED")
            self.assertEqual(said["details"], {"reason": "UNAUTHENTICATED"})
            said = call_client(address, "upload", plume(24), token="open sesame")
            self.assertEqual(said["offsets"], [[0]])


if __name__ == "__main__":
    programs = Programs(*sys.argv[1:])
    halflightd, start_client = programs.halflightd, programs.start_client
    call_client, cpp_client = programs.call_client, programs.cpp_client
    unittest.main(argv=[f"interop_test.py {sys.argv[1]}"], verbosity=2)
