"""One command of the client, for interop_test.py: prints what it got as one line of JSON.

    main.py ADDRESS COMMAND ARGUMENT...

Requests are files with a RenderFrameRequest in protobuf JSON, as `halflight render --print-scene`
writes them. HALFLIGHT_TOKEN says who calls.
"""

import json
import os
import sys

import grpc
from google.protobuf import json_format

import halflight


def read_request(client, path):
    with open(path, encoding="utf-8") as file:
        return json_format.Parse(file.read(), client.new("RenderFrameRequest"))


def write(paths, outputs):
    for path, output in zip(paths, outputs, strict=True):
        with open(path, "wb") as file:
            file.write(output)


def described(header):
    return json_format.MessageToDict(header, preserving_proto_field_name=True)


def health(client):
    stub = client.reflection.stub("grpc.health.v1.Health")
    request = client.reflection.message("grpc.health.v1.HealthCheckRequest")
    answer = stub.Check(request(), timeout=30)
    return {"status": json_format.MessageToDict(answer)["status"]}


def upload(client, *plys):
    sets = [halflight.read_ply(path) for path in plys]
    return {"offsets": client.upload_missing(sets), "sha256": [each.sha256.hex() for each in sets]}


def render(client, request, *paths):
    header, outputs = client.render(read_request(client, request))
    write(paths, outputs)
    return described(header)


def sequence(client, request, count, *plys_and_paths):
    plys, paths = plys_and_paths[:int(count)], plys_and_paths[int(count):]
    sets = [halflight.read_ply(path) for path in plys]
    client.upload_missing(sets)
    requests = [client.new("RenderFrameRequest", scene={"particle_sha256": each.sha256})
                for each in sets]
    requests[0] = read_request(client, request)  # what the others leave out stays as it is here
    each = len(paths) // len(plys)
    headers = []
    for i, (header, outputs) in enumerate(client.render_sequence(requests)):
        write(paths[i * each:(i + 1) * each], outputs)
        headers.append(described(header))
    return {"frames": headers}


def cancel(client, request):
    """Cancels a frame as soon as standard input ends."""
    stream = client.start_render(read_request(client, request))
    sys.stdin.read()
    stream.cancel()
    next(stream)
    return {}


COMMANDS = {command.__name__: command for command in (health, upload, render, sequence, cancel)}


def main(address, command, *arguments):
    client = halflight.Client(address, os.environ.get("HALFLIGHT_TOKEN"))
    try:
        result = COMMANDS[command](client, *arguments)
    except grpc.RpcError as error:
        result = {"code": error.code().name, "message": error.details(),
                  "details": client.details(error)}
    except halflight.Damaged as error:
        result = {"damaged": str(error)}
    print(json.dumps(result))


main(*sys.argv[1:])
