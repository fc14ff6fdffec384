/* Remote I/O by libmodbus, for the tests of the Modbus clients.
 *
 *     remote_io tcp PORT
 *     remote_io rtu DEVICE
 *
 * Coils show as discrete inputs and holding registers as input registers, at the same addresses.
 * Every change that the client writes is a line on standard output: `coil 0 1`, `holding 5 77`.
 */

#include <errno.h>
#include <modbus.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { COUNT = 100 };

static void show(modbus_mapping_t *map)
{
    for (int at = 0; at < COUNT; at++) {
        if (map->tab_input_bits[at] != map->tab_bits[at])
            printf("coil %d %d\n", at, map->tab_input_bits[at] = map->tab_bits[at]);
        if (map->tab_input_registers[at] != map->tab_registers[at])
            printf("holding %d %d\n", at, map->tab_input_registers[at] = map->tab_registers[at]);
    }
    fflush(stdout);
}

static void serve(modbus_t *bus, modbus_mapping_t *map)
{
    uint8_t query[MODBUS_TCP_MAX_ADU_LENGTH];
    for (;;) {
        int length = modbus_receive(bus, query);
        if (length > 0 && modbus_reply(bus, query, length, map) >= 0)
            show(map);
        /* A frame that is broken or another's: libmodbus waits for the next. */
        else if (length < 0 && errno != EMBBADCRC && errno != EMBBADDATA && errno != ETIMEDOUT)
            return;
    }
}

int main(int count, char **words)
{
    if (count != 3)
        return 2;
    int is_tcp = !strcmp(words[1], "tcp");
    modbus_mapping_t *map = modbus_mapping_new(COUNT, COUNT, COUNT, COUNT);
    modbus_t *bus = is_tcp ? modbus_new_tcp("127.0.0.1", atoi(words[2]))
                           : modbus_new_rtu(words[2], 19200, 'N', 8, 2);
    modbus_set_slave(bus, is_tcp ? MODBUS_TCP_SLAVE : 1);
    int listener = is_tcp ? modbus_tcp_listen(bus, 1) : modbus_connect(bus);
    if (listener < 0) {
        fprintf(stderr, "%s\n", modbus_strerror(errno));
        return 1;
    }
    puts("ready");
    fflush(stdout);
    do {
        if (is_tcp && modbus_tcp_accept(bus, &listener) < 0)
            return 1;
        serve(bus, map);
        if (is_tcp)
            close(modbus_get_socket(bus));
    } while (is_tcp);
    return 0;
}
