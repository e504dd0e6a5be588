"""A client of halflight.v1.RenderService that knows the service by reflection only."""

import array
import collections
import hashlib
import struct
import sys
import time

import grpc

from reflection import Reflection

CHUNK_BYTES = 256 << 10
# ParticleAttribute: number, and names of its components in a PLY file.
ATTRIBUTES = {1: ("x", "y", "z"), 2: ("radius",), 3: ("opacity",), 4: ("red", "green", "blue"),
              5: ("vx", "vy", "vz"), 6: ("emission_r", "emission_g", "emission_b")}
RETRIED = (grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.RESOURCE_EXHAUSTED,
           grpc.StatusCode.OUT_OF_RANGE, grpc.StatusCode.DATA_LOSS)
TRIES = 6

Particles = collections.namedtuple("Particles", "count attributes payload sha256")


def read_ply(path):
    """The particles of a binary little-endian PLY file whose properties are all floats."""
    with open(path, "rb") as file:
        names = []
        for line in iter(file.readline, b"end_header\n"):
            words = line.decode().split()
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            elif words[0] == "property":
                names.append(words[2])
        values = array.array("f", file.read(4 * count * len(names)))
    if sys.byteorder == "big":
        values.byteswap()
    attributes, payload = [], b""
    for number, components in ATTRIBUTES.items():
        if not set(components) <= set(names):
            continue
        column = array.array("f", bytes(4 * count * len(components)))
        for i, name in enumerate(components):
            column[i::len(components)] = values[names.index(name)::len(names)]
        if sys.byteorder == "big":
            column.byteswap()
        attributes.append(number)
        payload += column.tobytes()
    # What the name of a set covers before the payload: particles.proto. The origin is 0, 0, 0.
    bits = sum(1 << number for number in attributes)
    prefix = struct.pack("<4sIQ3d", b"HLP1", bits, count, 0, 0, 0)
    return Particles(count, attributes, payload, hashlib.sha256(prefix + payload).digest())


def _crc32c_table():
    for byte in range(256):
        for _ in range(8):
            byte = byte >> 1 ^ (0x82F63B78 if byte & 1 else 0)
        yield byte


CRC32C_TABLE = list(_crc32c_table())


def crc32c(data):
    """CRC-32C (Castagnoli); zlib.crc32 is another one."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc = CRC32C_TABLE[(crc ^ byte) & 255] ^ crc >> 8
    return crc ^ 0xFFFFFFFF


class Damaged(Exception):
    """What arrived is not what the server sent."""


def frames(responses):
    """(header, [bytes of each output]) of each frame in a stream, once it is whole and checked."""
    header = None
    for response in responses:
        part = response.WhichOneof("part")
        if part == "header":
            header, outputs = response.header, [bytearray() for _ in response.header.outputs]
        elif part == "chunk":
            output = outputs[response.chunk.output_index]
            if response.chunk.offset != len(output):
                raise Damaged(f"a chunk at {response.chunk.offset}, expected at {len(output)}")
            output += response.chunk.data
        elif part == "trailer":
            for i, (info, output, promised) in enumerate(
                    zip(header.outputs, outputs, response.trailer.output_crc32c, strict=True)):
                if len(output) != info.byte_size or crc32c(output) != promised:
                    raise Damaged(f"output {i}: size or CRC-32C is not as promised")
            yield header, [bytes(output) for output in outputs]
            header = None
    if header is not None:
        raise Damaged("the stream ended within a frame")


class Client:
    def __init__(self, address, token=None):
        self.channel = grpc.insecure_channel(address, options=[
            ("grpc.enable_http_proxy", 0), ("grpc.initial_reconnect_backoff_ms", 100)])
        self.reflection = Reflection(self.channel)
        self.service = self.reflection.stub("halflight.v1.RenderService")
        self.token = [("authorization", f"Bearer {token}")] if token else []

    def new(self, name, **fields):
        return self.reflection.message(f"halflight.v1.{name}")(**fields)

    def _options(self, sha256=b""):
        """Of a call: the route is for proxies before several servers, which hold different sets."""
        route = [("halflight-particle-sha256", sha256.hex())] if sha256 else []
        return {"metadata": self.token + route, "timeout": 600, "wait_for_ready": True}

    def upload_missing(self, sets):
        """Uploads those particle sets that the server lacks. Of each try the offset it began at."""
        missing = self.service.FindMissingParticles(
            self.new("FindMissingParticlesRequest", sha256=[each.sha256 for each in sets]),
            **self._options()).missing_sha256
        return [self.upload(each) for each in sets if each.sha256 in missing]

    def upload(self, particles):
        """Uploads, and goes on where it broke off. Of each try the offset it began at."""
        offsets, damaged = [], False
        while True:
            there = self.service.QueryUpload(
                self.new("QueryUploadRequest", sha256=particles.sha256),
                **self._options(particles.sha256))
            if there.complete:
                return offsets
            offsets.append(0 if damaged else there.committed_bytes)
            try:
                self.service.UploadParticles(
                    self._upload_messages(particles, offsets[-1]),
                    **self._options(particles.sha256))
                return offsets
            except grpc.RpcError as error:
                if error.code() not in RETRIED or len(offsets) == TRIES:
                    raise
                damaged = error.code() is grpc.StatusCode.DATA_LOSS
                time.sleep(self.details(error).get("retry_s") or 0.1 * 2 ** len(offsets))

    def _upload_messages(self, particles, offset):
        message = self.reflection.message("halflight.v1.UploadParticlesRequest")
        size, name = len(particles.payload), particles.sha256
        yield message(header={
            "layout": {"count": particles.count, "attributes": particles.attributes},
            "byte_size": size, "sha256": name, "resume_offset": offset})
        for at in range(offset, size, CHUNK_BYTES):
            yield message(chunk=particles.payload[at:at + CHUNK_BYTES])
        yield message(finish={"byte_size": size, "sha256": name})

    def start_render(self, request):
        """The stream of responses: to be read by frames(), or to be cancelled."""
        return self.service.RenderFrame(request, **self._options(request.scene.particle_sha256))

    def render(self, request):
        """The header of the frame, and the bytes of each output."""
        (frame,) = frames(self.start_render(request))
        return frame

    def render_sequence(self, requests):
        """Yields what render() gives, for each request in turn."""
        stream = self.service.RenderSequence(
            (self.new("RenderSequenceRequest", frame=request) for request in requests),
            **self._options(requests[0].scene.particle_sha256))
        count = 0
        for count, frame in enumerate(frames(stream), 1):
            yield frame
        if count != len(requests):
            raise Damaged(f"{count} frames came, expected {len(requests)}")

    def details(self, error):
        """What an error says to programs, of error.proto: reason, field, value, allowed, retry_s."""
        said = {}
        for key, data in error.trailing_metadata() or ():
            if key != "grpc-status-details-bin":
                continue
            for detail in self.reflection.message("halflight.rpc.Status").FromString(data).details:
                # google.rpc.X of the type's address is halflight.rpc.X here.
                name = detail.type_url.rpartition(".")[2]
                read = self.reflection.message(f"halflight.rpc.{name}").FromString(detail.value)
                if name == "ErrorInfo":
                    said.update(read.metadata, reason=read.reason)
                elif name == "BadRequest":
                    said["field"] = read.field_violations[0].field
                elif name == "RetryInfo":
                    said["retry_s"] = read.retry_delay.seconds + read.retry_delay.nanos / 1e9
        return said
