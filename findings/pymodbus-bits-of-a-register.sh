#!/usr/bin/env bash
# pymodbus 3.16.1: convert_from_registers(…, DATATYPE.BITS) lists the high byte first and each byte from its lowest bit, so that
# index 0 is the register's bit 8 and index 8 its bit 0. A drive's status word in which bit 3 is the fault shows it at index 11.
# convert_to_registers is the exact way back, so that a round trip hides it; read_coils counts from bit 0 in order.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet pymodbus==3.16.1
"$dir/venv/bin/python" - <<'PY'
from pymodbus.client.mixin import ModbusClientMixin as Mixin
from pymodbus.pdu.bit_message import ReadCoilsResponse

kind = Mixin.DATATYPE.BITS
at = [Mixin.convert_from_registers([1 << bit], kind).index(True) for bit in range(16)]
print("bit of the register -> index in the list:", dict(enumerate(at)))
assert at == [8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7], at
assert all(Mixin.convert_to_registers(Mixin.convert_from_registers([word], kind), kind) == [word] for word in range(0, 65536, 77))
coils = ReadCoilsResponse()
coils.decode(bytes([2, 0b0000_1000, 0]))
print("coils of the bytes 08 00: index", coils.bits.index(True))
assert coils.bits.index(True) == 3
PY
echo "pymodbus 3.16.1 still lists the high byte first"
