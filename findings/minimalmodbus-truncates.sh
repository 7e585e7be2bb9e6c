#!/usr/bin/env bash
# minimalmodbus 2.1.1: write_register(address, value, number_of_decimals) cuts value·10^decimals off instead of rounding it. A
# current of 0.29 A set with two decimals goes out as 28 = 0.28 A, without an error. Seen on the bytes at the other end of a pty.
set -euo pipefail
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet minimalmodbus==2.1.1 pyserial==3.5
"$dir/venv/bin/python" - <<'PY'
import os, pty, threading, tty
import minimalmodbus

near, far = pty.openpty()
tty.setraw(near), tty.setraw(far)
sent = []

def device():
    """A register that takes whatever is written: function 6 is answered by its own bytes."""
    while True:
        request = os.read(near, 8)
        while len(request) < 8:
            request += os.read(near, 8 - len(request))
        sent.append(int.from_bytes(request[4:6], "big"))
        os.write(near, request)

threading.Thread(target=device, daemon=True).start()
supply = minimalmodbus.Instrument(os.ttyname(far), 1)
supply.serial.timeout = 2
for amperes in (0.29, 0.57, 1.15, 4.35, 2.50):
    supply.write_register(9, amperes, number_of_decimals=2, functioncode=6)
print("asked, A:", [0.29, 0.57, 1.15, 4.35, 2.50], " sent, 0.01 A:", sent)
low = sum(int(float(n / 100) * 100) != n for n in range(1, 601))
print(f"of the 600 set-points 0.01 ... 6.00 A {low} go out one step low")
assert sent == [28, 56, 114, 434, 250], sent
assert low == 37, low
PY
echo "minimalmodbus 2.1.1 still truncates"
