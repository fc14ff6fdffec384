//! Events of clients from outside: Modbus clients and operators.

rows! {
    MODBUS_LISTENS = 701, "modbus-listens", Info, NONE, ByName:
        "a4c1d8cf098e46b5a5cc74aec493306d",
        "The Modbus server listens at this address.",
        "Nothing.";

    MODBUS_EXPOSED = 702, "modbus-exposed", Warn, NONE, ByName:
        "55dcaa1d93f240889fd0d410ef270289",
        "The Modbus server listens beyond this machine. Modbus has no passwords: every client \
         that reaches the address can write.",
        "Listen at 127.0.0.1, or let a firewall admit only the clients that you mean.";

    MODBUS_CONNECTED = 703, "modbus-connected", Info, CLIENTS, ByName:
        "2ab13dab52f94f2a9a5fc39d3332330a",
        "A Modbus client connected.",
        "Nothing.";

    MODBUS_GONE = 704, "modbus-gone", Info, CLIENTS, ByName:
        "c2a2bf5779a2441eb979d045f374bb50",
        "A Modbus client closed its connection, was silent for too long, or was lost.",
        "Nothing. If a client comes and goes all the time, look at the client.";

    MODBUS_CLOSED = 705, "modbus-closed", Warn, CLIENTS, ByName:
        "7ea08f62ba1a4bff85ab507a5cf51ae7",
        "rungd closed a Modbus client's connection: the client sent bytes that are not Modbus TCP, \
         or did not finish a frame or take a reply in time; or it had sent no request yet, and a \
         new client needed its place.",
        "Find out which program runs at that address.";

    MODBUS_FULL = 706, "modbus-full", Warn, CLIENTS, ByName:
        "be78018cf1ab44a08c7703ddff5bfa34",
        "rungd refused a Modbus client, because all connections are taken.",
        "Find out which clients hold them (the modbus-connected lines), or raise `[modbus-server] \
         connections`.";

    MODBUS_ACCEPT_FAILED = 707, "modbus-accept-failed", Warn, CLIENTS, ByName:
        "cb78e8e8c4fa41148a02b4099c10b1ab",
        "The Modbus server could not accept a client. It tries again. Scans continue.",
        "See the error: if too many files are open, raise `LimitNOFILE=` in the unit.";

    MODBUS_READ_REFUSED = 708, "modbus-read-refused", Debug, CLIENTS, ByName:
        "fea1f45a9b37442e97caa7e530cb0643",
        "A Modbus client read an address that is not in the map, and got the exception.",
        "Compare the client's addresses with `[modbus-server]`, docs/modbus.md.";

    MODBUS_WRITE_REFUSED = 709, "modbus-write-refused", Warn, CLIENTS, ByName:
        "6dc0ac9b6dcd4f9289d71ca3e84d60bc",
        "rungd refused a Modbus client's write, and answered with the exception. The line says \
         why.",
        "In STOP and FAULT rungd refuses all writes. In RUN, compare the client's addresses and \
         values with `[modbus-server]`, docs/modbus.md.";

    MODBUS_STOPS = 710, "modbus-stops", Info, NONE, ByName:
        "76411a173e634400bb192c221031f919",
        "The Modbus server stops, and closes all its connections.",
        "Nothing: rungd ends.";

    MODBUS_BUG = 711, "modbus-bug", Error, CLIENTS, Never:
        "175c63d8a54b4079b4b4a4a4c9d0c90b",
        "A bug in rungd ended a Modbus client's connection. The other clients and the scan \
         continue.",
        "Report the line with the lines around it, and what the client sent.";

    OPERATOR_WRITE = 801, "operator-write", Info, NONE, Never:
        "dca6ef34d7724d1db0beeeff1629c0fb",
        "An operator wrote a value: user, operand, value before, value after.",
        "Nothing, if you know the user.";

    OPERATOR_FORCE = 802, "operator-force", Info, NONE, Never:
        "25c1f14a671540558f6ff0f2d58757be",
        "An operator forced a bit or word. It keeps this value, whatever the ladder or the plant \
         writes, until the force is released. $ForcesActive is ON.",
        "Release the force with `rungd unforce` as soon as it has served its purpose.";

    OPERATOR_UNFORCE = 803, "operator-unforce", Info, NONE, Never:
        "944467982f994297a06939f3d9bc5b3a",
        "An operator released a force. The value stays until the ladder, a device or an operator \
         writes it.",
        "Nothing.";

    OPERATOR_MODE = 804, "operator-mode", Info, NONE, Never:
        "a3317009e0394e38a095d0eaaba52d2f",
        "An operator asked for a change of mode: user, old mode, new mode.",
        "Nothing, if you know the user. The mode-run or mode-stop line has the scan; it is before \
         or after this line, because two threads write them.";

    OPERATOR_LOG_LEVEL = 805, "operator-log-level", Info, NONE, Never:
        "962be9f0526e4795834299b7abc06f27",
        "An operator changed the level of the log. A restart undoes the change.",
        "Set it back with `rungd log-level info` when the search is over.";

    OPERATOR_REFUSED = 806, "operator-refused", Warn, CLIENTS, Never:
        "8e86e75a34394c018c2194db98690146",
        "rungd refused a request on the operator's socket. The line names the user and the \
         reason.",
        "If the request was meant: see the group of `[operator]`, or the operand's address and \
         range. If it was not: ask the user.";

    OPERATOR_LISTENS = 807, "operator-listens", Info, NONE, ByName:
        "ac843103e6304e2b9c2dc286d51a2a91",
        "A socket is open: at the operator's socket every user in its group can look and command, \
         at the view socket only look.",
        "Nothing.";

    OPERATOR_CONNECTED = 808, "operator-connected", Debug, CLIENTS, ByName:
        "a650c72e14544f2497e698cf5b801aae",
        "An operator's client connected.",
        "Nothing.";

    OPERATOR_ACCEPT_FAILED = 809, "operator-accept-failed", Warn, CLIENTS, ByName:
        "518fe21455194e5fa6e90b3baf40851c",
        "A socket for operators could not accept a client. It tries again. Scans continue.",
        "See the error: if too many files are open, raise `LimitNOFILE=` in the unit.";

    OPERATOR_READ_REFUSED = 810, "operator-read-refused", Debug, CLIENTS, ByName:
        "9cb5cdfdb4424b9495800fdfc5459a0d",
        "rungd refused a request on the operator's socket that would have changed nothing. The \
         line names the user and the reason.",
        "Compare the operand with the ladder's tags.";

    OPERATOR_BUG = 811, "operator-bug", Error, CLIENTS, Never:
        "7761a560e91b4504a197cee4e095ca6b",
        "A bug in rungd ended an operator's connection. The other clients and the scan continue.",
        "Report the line with the lines around it, and what the operator asked.";

    OPERATOR_GONE = 812, "operator-gone", Debug, CLIENTS, ByName:
        "0bb1e9030a2943ea9f44a7e1f2ddc1ff",
        "An operator's client left, or rungd closed its connection; why says which.",
        "Nothing.";

    OPERATOR_NO_SOCKET = 813, "operator-no-socket", Warn, CLIENTS, ByName:
        "e222b907ebd44320bdd5c57d45286cf8",
        "rungd could not make the operator's socket at the place that the environment names, or \
         the view socket beside it: there are no operator's commands, or no socket for looks \
         alone. The controller runs.",
        "The line says why. Name a place by `[operator] socket` or `view-socket`, or write \
         `enabled = false`.";

    OPERATOR_SOCKET_LOST = 814, "operator-socket-lost", Warn, CLIENTS, ByName:
        "c39c417f96cf477fac0b592658e6e77f",
        "Something removed the operator's socket or the view socket while the controller ran. \
         rungd makes it again; until then, no request reaches the controller by it. Scans \
         continue.",
        "Find out which program clears the folder, or correct what the line names.";

    OPERATOR_ACK = 815, "operator-ack", Info, NONE, Never:
        "23854393a6dd4c85a3bcaee0260974f1",
        "An operator acknowledged an alarm: user, tag, state before, state after. An alarm that \
         stands stays in the list as acknowledged; one that went away before leaves the list.",
        "Nothing, if you know the user.";

    OPERATOR_SHELVE = 816, "operator-shelve", Info, NONE, Never:
        "46e39c057a0e40d2833eabbcb985ebd5",
        "An operator shelved an alarm for a time, or took it out of service: user, tag, reason. It \
         is still followed and logged, but nobody has to care for it.",
        "Nothing, if you know the user.";

    OPERATOR_UNSHELVE = 817, "operator-unshelve", Info, NONE, Never:
        "4457903d28d0435db996b697574a1a70",
        "An operator brought a shelved alarm back, or returned an alarm to service.",
        "Nothing, if you know the user.";
}
