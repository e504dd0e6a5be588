"""Calls gRPC services through server reflection alone: nothing generated, no .proto file at hand.

Knows nothing of halflight. Only the reflection service itself has to be known beforehand; its
messages are written out below, as far as they are used.
"""

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

REFLECTION = "grpc.reflection.v1alpha"
FIELD = descriptor_pb2.FieldDescriptorProto


def _class_of(pool, descriptor):
    """The Python class of a message; protobuf 4.22 has renamed what makes it."""
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(descriptor)
    return message_factory.MessageFactory(pool).GetPrototype(descriptor)


def _describe_reflection(pool):
    """grpc/reflection/v1alpha/reflection.proto. Its oneofs look the same on the wire without."""
    file = descriptor_pb2.FileDescriptorProto(
        name="reflection.proto", package=REFLECTION, syntax="proto3")

    def message(name, *fields):
        described = file.message_type.add(name=name)
        for number, field, kind, label in fields:
            scalar = isinstance(kind, int)
            described.field.add(
                name=field, number=number, label=label,
                type=kind if scalar else FIELD.TYPE_MESSAGE,
                type_name=None if scalar else f".{REFLECTION}.{kind}")

    one, many = FIELD.LABEL_OPTIONAL, FIELD.LABEL_REPEATED
    message("ServerReflectionRequest",
            (4, "file_containing_symbol", FIELD.TYPE_STRING, one),
            (7, "list_services", FIELD.TYPE_STRING, one))
    message("ServerReflectionResponse",
            (4, "file_descriptor_response", "FileDescriptorResponse", one),
            (6, "list_services_response", "ListServiceResponse", one),
            (7, "error_response", "ErrorResponse", one))
    message("FileDescriptorResponse", (1, "file_descriptor_proto", FIELD.TYPE_BYTES, many))
    message("ListServiceResponse", (1, "service", "ServiceResponse", many))
    message("ServiceResponse", (1, "name", FIELD.TYPE_STRING, one))
    message("ErrorResponse",
            (1, "error_code", FIELD.TYPE_INT32, one), (2, "error_message", FIELD.TYPE_STRING, one))
    pool.Add(file)


class Stub:
    """One attribute a method, called as those of generated stubs are."""

    def __init__(self, channel, pool, service):
        described = descriptor_pb2.ServiceDescriptorProto()
        service.CopyToProto(described)
        for method, streams in zip(service.methods, described.method):
            shape = "{}_{}".format("stream" if streams.client_streaming else "unary",
                                   "stream" if streams.server_streaming else "unary")
            request = _class_of(pool, method.input_type)
            response = _class_of(pool, method.output_type)
            setattr(self, method.name, getattr(channel, shape)(
                f"/{service.full_name}/{method.name}",
                request_serializer=request.SerializeToString,
                response_deserializer=response.FromString))


class Reflection:
    """What the server behind `channel` says of itself; asked once for each file."""

    def __init__(self, channel):
        own = descriptor_pool.DescriptorPool()
        _describe_reflection(own)
        self._request = _class_of(own, own.FindMessageTypeByName(
            f"{REFLECTION}.ServerReflectionRequest"))
        response = _class_of(own, own.FindMessageTypeByName(
            f"{REFLECTION}.ServerReflectionResponse"))
        self._info = channel.stream_stream(
            f"/{REFLECTION}.ServerReflection/ServerReflectionInfo",
            request_serializer=self._request.SerializeToString,
            response_deserializer=response.FromString)
        self._channel = channel
        self._pool = descriptor_pool.DescriptorPool()

    def services(self):
        """Full names of the services."""
        answer = self._ask(list_services="*")
        return [service.name for service in answer.list_services_response.service]

    def stub(self, service):
        """To call the service of this full name."""
        return Stub(self._channel, self._pool, self._find(
            service, self._pool.FindServiceByName))

    def message(self, name):
        """The class of the message of this full name."""
        return _class_of(self._pool, self._find(name, self._pool.FindMessageTypeByName))

    def _ask(self, **question):
        answer = next(self._info(iter([self._request(**question)]), timeout=30))
        if answer.HasField("error_response"):
            raise LookupError(f"{question}: {answer.error_response.error_message}")
        return answer

    def _find(self, name, find):
        try:
            return find(name)
        except KeyError:
            pass
        answer = self._ask(file_containing_symbol=name)
        files = {}  # the file of the name, and all that it imports
        for data in answer.file_descriptor_response.file_descriptor_proto:
            file = descriptor_pb2.FileDescriptorProto.FromString(data)
            files[file.name] = file
        self._add(next(iter(files)), files)
        for file in list(files):
            self._add(file, files)
        return find(name)

    def _add(self, name, files):
        """Adds a file after those that it imports."""
        file = files.pop(name, None)
        if file is not None:
            for imported in file.dependency:
                self._add(imported, files)
            self._pool.Add(file)
