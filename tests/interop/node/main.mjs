// One command of the client, for interop_test.py: prints what it got as one line of JSON.
//
//     node main.mjs ADDRESS COMMAND ARGUMENT...
//
// Requests are files with a RenderFrameRequest in protobuf JSON, as `halflight render --print-scene`
// writes them. HALFLIGHT_PROTOS is the folder with the .proto files, HALFLIGHT_TOKEN says who calls.

import { readFileSync, writeFileSync } from 'node:fs';
import { text } from 'node:stream/consumers';
import grpc from '@grpc/grpc-js';
import { Client, Damaged, frames, readPly } from './halflight.mjs';

const readRequest = (path) => JSON.parse(readFileSync(path));

function write(paths, outputs) {
  outputs.forEach((output, i) => writeFileSync(paths[i], output));
}

const commands = {
  async health(client) {
    const service = new client.api.grpc.health.v1.Health(...client.channel);
    return { status: (await client.call('Check', {}, null, service)).status };
  },

  async upload(client, ...plys) {
    const sets = plys.map(readPly);
    const offsets = await client.uploadMissing(sets);
    return { offsets, sha256: sets.map((set) => set.sha256.toString('hex')) };
  },

  async render(client, request, ...paths) {
    const { header, outputs } = await client.render(readRequest(request));
    write(paths, outputs);
    return header;
  },

  async sequence(client, request, count, ...plysAndPaths) {
    const plys = plysAndPaths.slice(0, count);
    const paths = plysAndPaths.slice(count);
    const sets = plys.map(readPly);
    await client.uploadMissing(sets);
    const requests = sets.map(({ sha256 }) => ({ scene: { particle_sha256: sha256 } }));
    requests[0] = readRequest(request); // what the others leave out stays as it is here
    const headers = [];
    for await (const { header, outputs } of client.renderSequence(requests)) {
      write(paths.splice(0, outputs.length), outputs);
      headers.push(header);
    }
    return { frames: headers };
  },

  // Cancels a frame as soon as standard input ends.
  async cancel(client, request) {
    const stream = client.startRender(readRequest(request));
    await Promise.all([frames(stream).next(), text(process.stdin).then(() => stream.cancel())]);
    return {};
  },
};

const [address, command, ...args] = process.argv.slice(2);
const { HALFLIGHT_PROTOS: protos, HALFLIGHT_TOKEN: token } = process.env;
const client = new Client(address, { protos, token });
try {
  console.log(JSON.stringify(await commands[command](client, ...args)));
} catch (error) {
  if (error instanceof Damaged) {
    console.log(JSON.stringify({ damaged: error.message }));
  } else if (error.code in grpc.status) {
    console.log(JSON.stringify({
      code: grpc.status[error.code], message: error.details, details: client.details(error),
    }));
  } else {
    throw error;
  }
}
process.exit();
