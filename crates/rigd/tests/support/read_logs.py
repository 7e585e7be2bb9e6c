"""How many messages the public readers find in each log: `python read_logs.py stream|whole LOG...`, a number a line.

stream: StreamReader, for a log whose writer was killed; whole: make_reader, by the index at the log's end.
Anything else than the end of the file is an error of the log and ends this program with a trace.
"""

import sys

from mcap.exceptions import EndOfFile
from mcap.reader import make_reader
from mcap.records import Message
from mcap.stream_reader import StreamReader


def stream(file):
    """Messages up to the end, or to where the file stops."""
    messages = 0
    try:
        for record in StreamReader(file, validate_crcs=True).records:
            messages += isinstance(record, Message)
    except EndOfFile:
        pass
    return messages


def whole(file):
    """Messages by the index, which must count the same."""
    reader = make_reader(file, validate_crcs=True)
    messages = sum(1 for _ in reader.iter_messages())
    stated = reader.get_summary().statistics.message_count
    assert messages == stated, f"{messages} messages, the summary says {stated}"
    return messages


if __name__ == "__main__":
    for path in sys.argv[2:]:
        with open(path, "rb") as log:
            print({"stream": stream, "whole": whole}[sys.argv[1]](log))
