"""A Modbus RTU server of another hand (pymodbus) for the trial of the project's master.

Usage: modbus_server.py PORT [BAUD]

200 holding registers from 0: the first hundred show another number at each request, the others keep what is written.
Prints `ready` when it serves; runs until it is ended.
"""

import asyncio
import sys

from pymodbus.framer import FramerType
from pymodbus.server import ModbusSerialServer
from pymodbus.simulator import DataType, SimData, SimDevice

requests = 0


async def count(_function, start, address, count, registers, set_values):
    """Lets the first hundred registers show the number of the request, each in a way of its own."""
    global requests
    requests += 1
    if set_values is None:
        for at in range(address, min(address + count, 100)):
            registers[at - start] = (requests + at * 257) & 0xFFFF


async def main(port, baud):
    device = SimDevice(1, simdata=[SimData(0, count=200, values=0, datatype=DataType.REGISTERS)], action=count)
    server = ModbusSerialServer(device, framer=FramerType.RTU, port=port, baudrate=baud)
    serving = asyncio.ensure_future(server.serve_forever())
    await asyncio.sleep(0.5)
    print("ready", flush=True)
    await serving


asyncio.run(main(sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 115200))
