"""Recordings that are damaged, or intact with contents that no robot records."""

import io
import random
import struct
from dataclasses import dataclass, field, replace

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from odd_input.mutated_files import mutated_bytes, mutated_text

FLOATS = [float("nan"), float("inf"), float("-inf"), 1e30, -1e30, 1e-40, 0.0, -0.0, -1.0, 1e5]
DOUBLES = [*FLOATS, 1e308, -1e308, 5e-324]
COUNTS = [0, 1, 2, 255, 65_536, 1 << 20, (1 << 31) - 1, 1 << 31, (1 << 32) - 1]
STAMPS_NS = [0, 1, -1, 10**9, -(10**9), 10**18, -(10**18), 1 << 62]
CDR_HEADER = 4
MOST_NS = (1 << 64) - 1


@dataclass
class Message:
    """What a file says of a message, and its bytes."""

    topic: str
    log_time: int
    publish_time: int
    sequence: int
    data: bytes


@dataclass
class Recording:
    """All that a file holds, in its order."""

    profile: str = ""
    topics: dict = field(default_factory=dict)
    messages: list = field(default_factory=list)
    attachments: list = field(default_factory=list)
    metadata: dict = field(default_factory=dict)

    @classmethod
    def read(cls, path, first_s):
        """The first seconds of a file."""
        with open(path, "rb") as file:
            reader = make_reader(file)
            recording = cls(profile=reader.get_header().profile)
            for schema, channel, message in reader.iter_messages(log_time_order=False):
                recording.topics[channel.topic] = (schema, channel)
                recording.messages.append(
                    Message(
                        channel.topic, message.log_time, message.publish_time, message.sequence, message.data
                    )
                )
            end = min(message.log_time for message in recording.messages) + int(first_s * 1e9)
            recording.messages = [message for message in recording.messages if message.log_time < end]
            recording.attachments = [
                (one.name, one.media_type, one.data) for one in reader.iter_attachments()
            ]
            recording.metadata = {one.name: one.metadata for one in reader.iter_metadata()}
        return recording

    def written(self, compression=CompressionType.ZSTD, chunk_size=1 << 14):
        """As a file whose checksums are right."""
        out = io.BytesIO()
        writer = Writer(out, chunk_size=chunk_size, compression=compression)
        writer.start(self.profile, "mutations")
        for name, media_type, data in self.attachments:
            writer.add_attachment(0, 0, name, media_type, data)
        for name, values in self.metadata.items():
            writer.add_metadata(name, values)
        numbers = {}
        for topic, (schema, channel) in self.topics.items():
            number = writer.register_schema(schema.name, schema.encoding, schema.data) if schema else 0
            numbers[topic] = writer.register_channel(
                channel.topic, channel.message_encoding, number, channel.metadata
            )
        for message in self.messages:
            writer.add_message(
                numbers[message.topic],
                message.log_time % MOST_NS,
                message.data,
                message.publish_time % MOST_NS,
                message.sequence,
            )
        writer.finish()
        return out.getvalue()


def put(data, at, form, value):
    """The bytes with a number at a place."""
    changed = bytearray(data)
    struct.pack_into(form, changed, at, value)
    return bytes(changed)


def number(dice, data):
    """Another number at a place where one may be."""
    form, values = dice.choice([("<f", FLOATS), ("<d", DOUBLES), ("<I", COUNTS)])
    size = struct.calcsize(form)
    places = range(CDR_HEADER, len(data) - size + 1, size)
    return put(data, dice.choice(places), form, dice.choice(values)) if len(places) else data


def count(dice, data):
    """Another number where a count seems to stand: a small whole number."""
    places = range(CDR_HEADER, len(data) - 3, 4)
    counts = [at for at in places if 0 < struct.unpack_from("<I", data, at)[0] <= 1000]
    if not counts:
        return data
    at = dice.choice(counts)
    near = struct.unpack_from("<I", data, at)[0] + dice.choice([-1, 1])
    return put(data, at, "<I", dice.choice([*COUNTS, near]))


def letters(dice, data):
    """Bytes that are no text where letters are."""
    places = [at for at, byte in enumerate(data) if 97 <= byte <= 122 and at > CDR_HEADER]
    changed = bytearray(data)
    for at in places[: dice.choice([1, 3, len(places)])]:
        changed[at] = dice.choice([0xFF, 0xC0, 0x00, 0x0A])
    return bytes(changed)


def length(dice, data):
    """Cut off, or with more behind."""
    return dice.choice([data[: dice.randrange(len(data) + 1)], data + bytes(dice.choice([1, 4, 4096])), b""])


def of_messages(dice, recording):
    """The contents of some messages of one topic: one, some or all of them."""
    change = dice.choice([number, number, count, letters, length])
    topic = dice.choice(sorted({message.topic for message in recording.messages}))
    share = dice.choice([0.03, 0.3, 1.0])
    for k, message in enumerate(recording.messages):
        if message.topic == topic and dice.random() < share:
            recording.messages[k] = replace(message, data=change(dice, message.data))


def of_times(dice, recording):
    """The times of some messages: back, far ahead, all the same."""
    share, by = dice.choice([0.03, 0.5, 1.0]), dice.choice(STAMPS_NS)
    is_set = dice.random() < 0.3
    for k, message in enumerate(recording.messages):
        if dice.random() < share:
            times = [by if is_set else at + by for at in (message.log_time, message.publish_time)]
            recording.messages[k] = replace(message, log_time=max(times[0], 0), publish_time=max(times[1], 0))


def of_stamps(dice, recording):
    """The stamps in headers of some messages: their first two numbers."""
    share = dice.choice([0.03, 0.5, 1.0])
    for k, message in enumerate(recording.messages):
        if dice.random() < share and len(message.data) >= CDR_HEADER + 8:
            seconds = dice.choice([0, -1, 1, (1 << 31) - 1, -(1 << 31)])
            data = put(message.data, CDR_HEADER, "<i", seconds)
            data = put(data, CDR_HEADER + 4, "<I", dice.choice([0, 999_999_999, 10**9, (1 << 32) - 1]))
            recording.messages[k] = replace(message, data=data)


def of_order(dice, recording):
    """Messages left out, repeated, shuffled or backwards."""
    messages = recording.messages
    kind = dice.randrange(5)
    if kind == 0:
        recording.messages = [message for message in messages if dice.random() < 0.5]
    elif kind == 1:
        recording.messages = [message for message in messages for _ in range(dice.choice([1, 1, 5]))]
    elif kind == 2:
        dice.shuffle(messages)
    elif kind == 3:
        messages.reverse()
    else:
        gone = dice.choice(sorted(recording.topics))
        recording.messages = [message for message in messages if message.topic != gone]


def of_topics(dice, recording):
    """Two topics exchanged, or a channel that says something else of itself."""
    topics = sorted(recording.topics)
    one, other = dice.choice(topics), dice.choice(topics)
    (schema, channel), (other_schema, other_channel) = recording.topics[one], recording.topics[other]
    kind = dice.randrange(4)
    if kind == 0:
        recording.topics[one], recording.topics[other] = (schema, other_channel), (other_schema, channel)
    elif kind == 1:
        recording.topics[one] = (other_schema, channel)
    elif kind == 2:
        recording.topics[one] = (schema, replace(channel, message_encoding=dice.choice(["", "json", "ros1"])))
    else:
        recording.topics[one] = (schema, replace(channel, topic=dice.choice(["", "/", "x" * 70_000, "/tf"])))


def of_attachments(dice, recording):
    """What goes with the messages: the rig, figures of the run."""
    kind = dice.randrange(4)
    if kind == 0 or not recording.attachments:
        recording.metadata = {name: {} for name in recording.metadata}
    elif kind == 1:
        recording.attachments = recording.attachments[1:] + recording.attachments[:1] * 2
    elif kind == 2:
        recording.attachments = []
    else:
        recording.attachments = [
            (name, media_type, mutated_text(dice, data)) for name, media_type, data in recording.attachments
        ]


CHANGES = [of_messages, of_messages, of_messages, of_times, of_stamps, of_order, of_topics, of_attachments]


def mutated_recording(seed, base):
    """One file; of even seeds the bytes are damaged, of odd ones the contents."""
    dice = random.Random(seed)
    recording = replace(
        base,
        topics=dict(base.topics),
        messages=list(base.messages),
        attachments=list(base.attachments),
        metadata=dict(base.metadata),
    )
    compression = dice.choice([CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE])
    if seed % 2 == 0:
        return mutated_bytes(dice, recording.written(compression))
    for _ in range(dice.choice([1, 1, 2])):
        dice.choice(CHANGES)(dice, recording)
    return recording.written(compression, chunk_size=dice.choice([1 << 10, 1 << 14, 1 << 22]))
