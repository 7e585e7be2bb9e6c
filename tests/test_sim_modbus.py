"""The simulated rig's servo and brake as an independent Modbus master sees them: pymodbus on the pseudo-terminals."""

import contextlib
import os
import pathlib
import subprocess
import time

import pytest
from pymodbus.client import ModbusSerialClient
from pymodbus.exceptions import ModbusIOException

RIGD = os.environ.get("RIGD", str(pathlib.Path(__file__).parents[1] / "target/release/rigd"))

# Delta ASDA-B2: the address of parameter Pg-ii is g * 0x100 + ii * 2; 32-bit values have their low word first.
SPEED_1 = 0x0112  # P1-09, 0.1 rpm, signed 32 bits
MAX_SPEED = 0x016E  # P1-55, rpm
RAMP_UP = 0x0144  # P1-34, ms
NO_PARAMETER = 0x0500
# Riden RD60xx
ID, SET_VOLTAGE, SET_CURRENT, OUT_VOLTAGE, ENABLE = 0, 8, 9, 10, 18


@pytest.fixture(scope="module")
def sim(tmp_path_factory):
    """The ports of a `rigd sim`, as `{device: (path, baud, stop bits, unit)}`."""
    directory = tmp_path_factory.mktemp("rig")
    process = subprocess.Popen([RIGD, "sim", "--pty-dir", str(directory)], stdout=subprocess.PIPE, text=True)
    begun = time.monotonic()
    ports = {}
    for line in process.stdout:
        if line == "ready\n":
            break
        device, path, baud, form, word, unit = line.split()
        assert word == "unit" and form.startswith("8N")
        ports[device] = (path, int(baud), int(form[2]), int(unit))
    assert time.monotonic() - begun < 10.0
    assert ports["servo"] == (str(directory / "servo"), 38400, 2, 1)
    assert ports["brake"] == (str(directory / "brake"), 115200, 1, 1)
    assert ports["counter"] == (str(directory / "counter"), 921600, 1, 0)
    yield ports
    process.terminate()
    assert process.wait(timeout=5) == 0


@contextlib.contextmanager
def master(port, retries=1):
    """A pymodbus master on a port, closed afterwards."""
    path, baud, stop_bits, unit = port
    client = ModbusSerialClient(path, baudrate=baud, stopbits=stop_bits, timeout=0.5, retries=retries)
    assert client.connect()
    try:
        yield client, unit
    finally:
        client.close()


def registers(answer):
    """The words of an answer that is no exception."""
    assert not answer.isError(), answer
    return answer.registers


def test_servo_holds_a_signed_speed_of_32_bits(sim):
    with master(sim["servo"]) as (servo, unit):
        for speed, words in ((123.4, [1234, 0]), (-123.4, [0x10000 - 1234, 0xFFFF]), (0.0, [0, 0])):
            answer = servo.write_registers(SPEED_1, words, device_id=unit)
            assert not answer.isError(), answer
            assert registers(servo.read_holding_registers(SPEED_1, count=2, device_id=unit)) == words
            value = servo.convert_from_registers(words, servo.DATATYPE.INT32, word_order="little")
            assert value == pytest.approx(10.0 * speed)


def test_servo_takes_one_word_by_function_6(sim):
    with master(sim["servo"]) as (servo, unit):
        for ramp_ms in (250, 3000):
            answer = servo.write_register(RAMP_UP, ramp_ms, device_id=unit)
            assert not answer.isError(), answer
            assert registers(servo.read_holding_registers(RAMP_UP, count=1, device_id=unit)) == [ramp_ms]
        assert registers(servo.read_holding_registers(MAX_SPEED, count=1, device_id=unit))[0] >= 3000


def test_an_unknown_register_answers_exception_2(sim):
    with master(sim["servo"]) as (servo, unit):
        for answer in (
            servo.read_holding_registers(NO_PARAMETER, count=1, device_id=unit),
            servo.write_register(NO_PARAMETER, 1, device_id=unit),
            servo.write_registers(NO_PARAMETER, [1, 0], device_id=unit),
        ):
            assert answer.isError() and answer.exception_code == 2, answer


@pytest.mark.parametrize("device", ["servo", "brake"])
def test_another_unit_is_met_with_silence(sim, device):
    with master(sim[device], retries=0) as (client, unit):
        with pytest.raises(ModbusIOException):
            client.read_holding_registers(0, count=1, device_id=unit + 1)
    # The line is as good as before.
    with master(sim[device]) as (client, unit):
        assert registers(client.read_holding_registers(0, count=1, device_id=unit))


def test_brake_supply_sets_a_current(sim):
    with master(sim["brake"]) as (brake, unit):
        model = registers(brake.read_holding_registers(ID, count=4, device_id=unit))[0]
        assert 60000 < model < 60300, "a Riden RD60xx"
        for address, value in ((SET_VOLTAGE, 1200), (SET_CURRENT, 250), (ENABLE, 1)):
            assert not brake.write_register(address, value, device_id=unit).isError()
            assert registers(brake.read_holding_registers(address, count=1, device_id=unit)) == [value]
        time.sleep(0.3)
        assert registers(brake.read_holding_registers(OUT_VOLTAGE, count=1, device_id=unit))[0] > 0
        for address in (ENABLE, SET_CURRENT):
            assert not brake.write_register(address, 0, device_id=unit).isError()


def test_a_port_may_be_closed_and_opened_again(sim):
    for _ in range(5):
        with master(sim["servo"]) as (servo, unit):
            assert registers(servo.read_holding_registers(SPEED_1, count=2, device_id=unit)) == [0, 0]
