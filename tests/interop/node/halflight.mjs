// A client of halflight.v1.RenderService, by the .proto files.

import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { endianness } from 'node:os';
import { Readable } from 'node:stream';
import { setTimeout as sleep } from 'node:timers/promises';
import grpc from '@grpc/grpc-js';
import protoLoader from '@grpc/proto-loader';

const CHUNK_BYTES = 256 << 10;
const TRIES = 6;
const { UNAVAILABLE, RESOURCE_EXHAUSTED, OUT_OF_RANGE, DATA_LOSS } = grpc.status;
const RETRIED = [UNAVAILABLE, RESOURCE_EXHAUSTED, OUT_OF_RANGE, DATA_LOSS];
// ParticleAttribute: number, and names of its components in a PLY file.
const ATTRIBUTES = new Map([
  [1, ['x', 'y', 'z']], [2, ['radius']], [3, ['opacity']], [4, ['red', 'green', 'blue']],
  [5, ['vx', 'vy', 'vz']], [6, ['emission_r', 'emission_g', 'emission_b']],
]);

// The particles of a binary little-endian PLY file whose properties are all floats.
export function readPly(path) {
  const bytes = readFileSync(path);
  const end = bytes.indexOf('end_header\n') + 'end_header\n'.length;
  const header = bytes.toString('latin1', 0, end);
  const count = Number(/^element vertex (\d+)$/m.exec(header)[1]);
  const names = [...header.matchAll(/^property float (\S+)$/gm)].map((match) => match[1]);
  const attributes = [];
  const columns = [];
  for (const [number, components] of ATTRIBUTES) {
    if (!components.every((name) => names.includes(name))) continue;
    const at = components.map((name) => 4 * names.indexOf(name));
    const column = Buffer.alloc(4 * count * at.length);
    for (let particle = 0, to = 0; particle < count; ++particle) {
      for (const offset of at) {
        const from = end + 4 * names.length * particle + offset;
        to += bytes.copy(column, to, from, from + 4);
      }
    }
    attributes.push(number);
    columns.push(column);
  }
  // What the name of a set covers before the payload: particles.proto. The origin is 0, 0, 0.
  const payload = Buffer.concat(columns);
  const prefix = Buffer.alloc(40);
  prefix.write('HLP1');
  prefix.writeUInt32LE(attributes.reduce((bits, number) => bits | (1 << number), 0), 4);
  prefix.writeBigUInt64LE(BigInt(count), 8);
  const sha256 = createHash('sha256').update(prefix).update(payload).digest();
  return { count, attributes, payload, sha256 };
}

const CRC32C_TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  for (let bit = 0; bit < 8; ++bit) byte = (byte >>> 1) ^ (byte & 1 ? 0x82f63b78 : 0);
  return byte;
});

// CRC-32C (Castagnoli); zlib.crc32 is another one.
export function crc32c(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) crc = CRC32C_TABLE[(crc ^ byte) & 255] ^ (crc >>> 8);
  return ~crc >>> 0;
}

// What arrived is not what the server sent.
export class Damaged extends Error {}

// { header, outputs: [bytes] } of each frame in a stream, once it is whole and checked.
export async function* frames(responses) {
  let header = null;
  let outputs;
  for await (const { part, ...response } of responses) {
    if (part === 'header') {
      header = response.header;
      outputs = header.outputs.map((info) => ({ info, bytes: 0, chunks: [] }));
    } else if (part === 'chunk') {
      const { output_index: index, offset, data } = response.chunk;
      const output = outputs[index];
      if (offset !== output.bytes) {
        throw new Damaged(`a chunk at ${offset}, expected at ${output.bytes}`);
      }
      output.chunks.push(data);
      output.bytes += data.length;
    } else if (part === 'trailer') {
      const promised = response.trailer.output_crc32c;
      const whole = outputs.map((output) => Buffer.concat(output.chunks));
      whole.forEach((bytes, i) => {
        if (bytes.length !== outputs[i].info.byte_size || crc32c(bytes) !== promised[i]) {
          throw new Damaged(`output ${i}: size or CRC-32C is not as promised`);
        }
      });
      yield { header, outputs: whole };
      header = null;
    }
  }
  if (header) throw new Damaged('the stream ended within a frame');
}

export class Client {
  constructor(address, { protos, token }) {
    // Names as in the .proto files and numbers as numbers, as protobuf's JSON is read.
    this.definition = protoLoader.loadSync(
      ['halflight/v1/service.proto', 'halflight/rpc_status.proto', 'grpc/health/v1/health.proto'],
      { includeDirs: [protos], keepCase: true, longs: Number, enums: String,
        defaults: true, oneofs: true });
    this.api = grpc.loadPackageDefinition(this.definition);
    this.channel = [address, grpc.credentials.createInsecure(),
      { 'grpc.enable_http_proxy': 0, 'grpc.initial_reconnect_backoff_ms': 100 }];
    this.service = new this.api.halflight.v1.RenderService(...this.channel);
    this.token = token;
  }

  // Of a call: the route is for proxies before several servers, which hold different sets.
  metadata(sha256) {
    const metadata = new grpc.Metadata({ waitForReady: true });
    if (sha256) metadata.set('halflight-particle-sha256', sha256.toString('hex'));
    if (this.token) metadata.set('authorization', `Bearer ${this.token}`);
    return metadata;
  }

  // One request, one response.
  call(method, request, sha256, service = this.service) {
    return new Promise((resolve, reject) => {
      service[method](request, this.metadata(sha256), options(),
        (error, response) => (error ? reject(error) : resolve(response)));
    });
  }

  // Uploads those particle sets that the server lacks. Of each try the offset it began at.
  async uploadMissing(sets) {
    const { missing_sha256: missing } =
      await this.call('FindMissingParticles', { sha256: sets.map((set) => set.sha256) });
    const offsets = [];
    for (const set of sets) {
      if (missing.some((sha256) => sha256.equals(set.sha256))) offsets.push(await this.upload(set));
    }
    return offsets;
  }

  // Uploads, and goes on where it broke off. Of each try the offset it began at.
  async upload(particles) {
    const offsets = [];
    for (let damaged = false; ;) {
      const { complete, committed_bytes: committed } =
        await this.call('QueryUpload', { sha256: particles.sha256 }, particles.sha256);
      if (complete) return offsets;
      offsets.push(damaged ? 0 : committed);
      try {
        await this.uploadFrom(offsets.at(-1), particles);
        return offsets;
      } catch (error) {
        if (!RETRIED.includes(error.code) || offsets.length === TRIES) throw error;
        damaged = error.code === DATA_LOSS;
        await sleep(1000 * (this.details(error).retry_s ?? 0.1 * 2 ** offsets.length));
      }
    }
  }

  uploadFrom(offset, particles) {
    return new Promise((resolve, reject) => {
      const call = this.service.UploadParticles(this.metadata(particles.sha256), options(),
        (error, response) => (error ? reject(error) : resolve(response)));
      Readable.from(uploadMessages(particles, offset)).pipe(call);
    });
  }

  // The stream of responses: to be read by frames(), or to be cancelled.
  startRender(request) {
    return this.service.RenderFrame(request, this.metadata(nameIn(request)), options());
  }

  // { header, outputs } of one frame.
  async render(request) {
    let frame;
    for await (frame of frames(this.startRender(request)));
    if (!frame) throw new Damaged('no frame came');
    return frame;
  }

  // Yields what render() gives, for each request in turn.
  async* renderSequence(requests) {
    const stream = this.service.RenderSequence(this.metadata(nameIn(requests[0])), options());
    Readable.from(requests.map((frame) => ({ frame }))).pipe(stream);
    let count = 0;
    for await (const frame of frames(stream)) {
      ++count;
      yield frame;
    }
    if (count !== requests.length) {
      throw new Damaged(`${count} frames came, expected ${requests.length}`);
    }
  }

  // What an error says to programs, of error.proto: reason, field, value, allowed, retry_s.
  details(error) {
    const said = {};
    for (const bytes of error.metadata?.get('grpc-status-details-bin') ?? []) {
      for (const detail of this.definition['halflight.rpc.Status'].deserialize(bytes).details) {
        // google.rpc.X of the type's address is halflight.rpc.X here.
        const name = detail.type_url.split('.').at(-1);
        const read = this.definition[`halflight.rpc.${name}`].deserialize(detail.value);
        if (name === 'ErrorInfo') Object.assign(said, read.metadata, { reason: read.reason });
        if (name === 'BadRequest') said.field = read.field_violations[0].field;
        if (name === 'RetryInfo') {
          said.retry_s = read.retry_delay.seconds + read.retry_delay.nanos / 1e9;
        }
      }
    }
    return said;
  }
}

// The particle set's name: bytes, or base64 as protobuf JSON has them.
function nameIn({ scene: { particle_sha256: sha256 } }) {
  return sha256 && Buffer.from(sha256, 'base64');
}

function options() {
  return { deadline: Date.now() + 600_000 };
}

function* uploadMessages({ count, attributes, payload, sha256 }, offset) {
  yield { header: { layout: { count, attributes }, byte_size: payload.length, sha256,
    resume_offset: offset } };
  for (let at = offset; at < payload.length; at += CHUNK_BYTES) {
    yield { chunk: payload.subarray(at, at + CHUNK_BYTES) };
  }
  yield { finish: { byte_size: payload.length, sha256 } };
}
