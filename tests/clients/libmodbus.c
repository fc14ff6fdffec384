/* The Modbus server before libmodbus. Run by tests/io/modbus_clients.rs with the port of a controller
 * that has the map of docs/modbus.md (mixer-controller.toml) and what is listed there; it prints
 * what went wrong and ends with 1, or prints "ok". */
#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int wrong = 0;

static void expect(const char *what, int seen, int wanted)
{
    if (seen != wanted) {
        printf("%s: %d, not %d (%s)\n", what, seen, wanted, modbus_strerror(errno));
        wrong = 1;
    }
}

/* The call failed with this exception. */
static void refused(const char *what, int done, int exception)
{
    expect(what, done, -1);
    expect(what, errno, MODBUS_ENOBASE + exception);
}

int main(int count, char **words)
{
    modbus_t *client = modbus_new_tcp("127.0.0.1", count > 1 ? atoi(words[1]) : 1502);
    uint16_t registers[16], values[4] = {0x1234, 0x5678, 7, 8};
    uint8_t bits[32];

    if (client == NULL || modbus_connect(client) == -1) {
        printf("no connection: %s\n", modbus_strerror(errno));
        return 1;
    }
    modbus_set_slave(client, 1);

    /* CT0.Acc at 4000 and 4001, the higher half first; D10 at 4002, the lower half first. */
    expect("write CT0.Acc", modbus_write_registers(client, 4000, 2, values), 2);
    expect("write D10", modbus_write_registers(client, 4002, 2, values), 2);
    expect("read both", modbus_read_registers(client, 4000, 4, registers), 4);
    expect("CT0.Acc", registers[0] == 0x1234 && registers[1] == 0x5678, 1);
    expect("D10", registers[2] == 0x1234 && registers[3] == 0x5678, 1);
    expect("as one value", MODBUS_GET_INT32_FROM_INT16(registers, 0), 0x12345678);
    refused("half of CT0.Acc", modbus_write_register(client, 4000, 1), 2);
    refused("D11", modbus_write_registers(client, 4004, 2, values), 2);

    /* MHR10: write, mask, write and read. */
    expect("write MHR10", modbus_write_register(client, 9, 0x12), 1);
    expect("mask MHR10", modbus_mask_write_register(client, 9, 0xf2, 0x25), 1);
    expect("read MHR10", modbus_read_registers(client, 9, 1, registers), 1);
    expect("MHR10", registers[0], 0x17);
    values[0] = 99;
    expect("write and read",
           modbus_write_and_read_registers(client, 9, 1, values, 8, 3, registers), 3);
    expect("MHR10 again", registers[1], 99);
    refused("MHR11", modbus_mask_write_register(client, 10, 0, 0), 2);

    /* X0..X15 and the Stage behind them. */
    expect("read X", modbus_read_input_bits(client, 2000, 17, bits), 17);
    expect("X0", bits[0], 0);
    expect("Mixing.Fill", bits[16], 1);
    refused("beyond", modbus_read_input_bits(client, 2000, 18, bits), 2);
    refused("MC1", modbus_write_bit(client, 0, 1), 2);
    refused("holding beyond", modbus_read_registers(client, 65535, 1, registers), 2);

    modbus_close(client);
    modbus_free(client);
    if (!wrong)
        printf("ok\n");
    return wrong;
}
