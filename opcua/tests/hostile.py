"""Strangers and hostile clients against `rungd-opcua`, with a foreign client (asyncua).

Usage: hostile.py RUNGD RUNGD_OPCUA FOLDER. Each passed part is a line `ok NAME`. Called by foreign.rs.
"""

import asyncio
import datetime
import os
import random
import re
import socket
import struct
import subprocess

import asyncua.client.client
from asyncua import Client, ua
from asyncua.crypto.cert_gen import generate_private_key, generate_self_signed_app_certificate
from asyncua.crypto.security_policies import SecurityPolicyAes128Sha256RsaOaep as Oaep
from asyncua.crypto.security_policies import SecurityPolicyAes256Sha256RsaPss as Pss
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256 as Basic
from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from support import (FOLDER, LADDER, OPCUA, PORT, RUNGD, URL, WAIT, Seen, awaits, condition_filter, controller,
                     end_all, is_value, passed, refused_with, rungd, server, settings, tag, value, write,
                     write_with_reason)

CLOSED = (ua.UaError, ConnectionError, asyncio.TimeoutError, TimeoutError)
SLOW = 30


def make_certificate(name):
    """A client's key and certificate in the folder."""
    private = generate_private_key()
    (FOLDER / f"{name}.pem").write_bytes(private.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()))
    made = generate_self_signed_app_certificate(
        private, name, {"organizationName": "t"}, [x509.UniformResourceIdentifier("urn:a-client")],
        extended=[ExtendedKeyUsageOID.CLIENT_AUTH], days=365,
    )
    (FOLDER / f"{name}.der").write_bytes(made.public_bytes(Encoding.DER))
    return private, made


def make_expired(name):
    """A certificate that was valid until yesterday."""
    private, made = make_certificate(name)
    now = datetime.datetime.now(datetime.timezone.utc)
    builder = x509.CertificateBuilder(made.issuer, made.subject, private.public_key(), made.serial_number)
    builder = builder.not_valid_before(now - datetime.timedelta(days=9))
    builder = builder.not_valid_after(now - datetime.timedelta(days=1))
    for extension in made.extensions:
        builder = builder.add_extension(extension.value, extension.critical)
    made = builder.sign(private, hashes.SHA256())
    (FOLDER / f"{name}.der").write_bytes(made.public_bytes(Encoding.DER))


ENCRYPTED = ua.MessageSecurityMode.SignAndEncrypt


async def connected(policy, user=None, password=None, mode=ENCRYPTED, name="a client", url=URL):
    client = Client(url, timeout=SLOW)
    client.application_uri = "urn:a-client"
    own = FOLDER / "pki/own/cert.der"
    files = [str(FOLDER / f"{name}.{ending}") for ending in ("der", "pem")]
    await client.set_security(policy, *files, server_certificate=str(own), mode=mode)
    if user:
        client.set_user(user)
        client.set_password(password)
    await client.connect()
    return client


async def refused(*words, **more):
    try:
        client = await connected(*words, **more)
    except CLOSED as error:
        return error
    await client.disconnect()
    raise AssertionError("it was let in")


def trust(name):
    listed = subprocess.run([OPCUA, "trust", "opcua.toml", "list"], cwd=FOLDER, capture_output=True, text=True)
    found = re.search(rf"rejected  ([0-9a-f]{{40}})  {name}", listed.stdout)
    assert found, listed
    subprocess.run([OPCUA, "trust", "opcua.toml", "add", found[1][:8]], cwd=FOLDER, check=True)
    return found[1]


def memory(process):
    """The most memory that a process has had, MB."""
    status = open(f"/proc/{process.process.pid}/status").read()
    return int(re.search(r"VmHWM:\s+(\d+)", status)[1]) / 1024


def hello():
    body = struct.pack("<IIIIII", 0, 65535, 65535, 0, 0, len(URL)) + URL.encode()
    return b"HELF" + struct.pack("<I", 8 + len(body)) + body


async def secure():
    """Encryption, a certificate that a person trusts, users."""
    await refused(Basic, "anna", "correct horse")
    thumbprint = trust("a client")
    await refused(Basic, "anna", "wrong password")
    await refused(Basic)
    await refused(Basic, "anna", "correct horse", mode=ua.MessageSecurityMode.Sign)
    for policy in (Basic, Pss, Oaep):
        client = await connected(policy, "anna", "correct horse")
        assert await value(client, "speed") is not None
        await tag(client, "speed").write_value(ua.Variant(5, ua.VariantType.Int32))
        await client.disconnect()
    assert re.search("anna.*speed|speed.*anna", (FOLDER / "rungd.log").read_text())
    mode = (FOLDER / "pki/private/private.pem").stat().st_mode & 0o777
    assert mode == 0o600, oct(mode)
    passed("encryption, trust and users")
    return thumbprint


async def strangers(client):
    """Bytes that are no OPC UA, and pieces of messages without a channel, end only their connection."""
    random.seed(1)
    for count in range(100):
        lengths = [0, 7, 8, 12, 2**31, 2**32 - 1]
        piece = b"OPNF" + struct.pack("<I", random.choice(lengths)) + random.randbytes(400)
        chunk = b"MSGC" + struct.pack("<I", 65535) + bytes(65527)
        for bytes_sent in (random.randbytes(1000), hello() + piece, hello() + chunk * 3):
            with socket.create_connection(("127.0.0.1", PORT), timeout=WAIT) as stranger:
                try:
                    stranger.sendall(bytes_sent)
                except OSError:
                    pass
    filter = condition_filter()
    operand = ua.ElementOperand(Index=0)
    filter.WhereClause.Elements[0].FilterOperator = ua.FilterOperator.Not
    filter.WhereClause.Elements[0].FilterOperands = [operand]
    subscription = await client.create_subscription(100, Seen())
    try:
        await subscription.subscribe_events(client.get_node(ua.NodeId("/", 2)), evfilter=filter)
        raise AssertionError("a filter that refers to itself was accepted")
    except ua.UaStatusCodeError:
        pass
    await subscription.delete()
    assert await value(client, "speed") is not None
    passed("strangers")


async def without_encryption(process):
    """Without encryption a server that wants it shows its endpoints, and opens no session."""
    endpoints = await Client(URL, timeout=SLOW).connect_and_get_server_endpoints()
    modes = {endpoint.SecurityMode for endpoint in endpoints}
    policies = {endpoint.SecurityPolicyUri.rsplit("#")[1] for endpoint in endpoints}
    assert modes == {ua.MessageSecurityMode.SignAndEncrypt}, modes
    assert policies == {"Basic256Sha256", "Aes128_Sha256_RsaOaep", "Aes256_Sha256_RsaPss"}, policies
    assert all(str(PORT) in endpoint.EndpointUrl for endpoint in endpoints), endpoints
    for _ in range(60):
        client = Client(URL, timeout=SLOW)
        await client.connect_socket()
        try:
            await client.send_hello()
            await client.open_secure_channel()
            await client.create_session()
            raise AssertionError("a session without encryption")
        except CLOSED:
            pass
        finally:
            client.disconnect_socket()
    client = await connected(Basic, "anna", "correct horse")
    assert await value(client, "speed") is not None
    await client.disconnect()
    log = process.log.read_text()
    assert "it asks for more than endpoints without encryption" in log, log
    passed("no session without encryption")


def closed(sent, more=b""):
    """Whether the server closes a connection with these bytes."""
    with socket.create_connection(("127.0.0.1", PORT), timeout=WAIT) as stranger:
        try:
            stranger.sendall(sent)
            for _ in range(4_000):
                stranger.sendall(more)
            while stranger.recv(65536):
                pass
        except (ConnectionError, BrokenPipeError):
            pass
    return True


async def lengths(process):
    """What a stranger announces, or sends without an end, takes no memory."""
    before, rest = memory(process), bytes(16_384)
    for announced in (b"OPNF", b"MSGF", b"MSGC", b"HELF"):
        for begin in (b"", hello()):
            for size in (65_536, 2**31 - 1, 2**32 - 1):
                assert await asyncio.to_thread(closed, begin + announced + struct.pack("<I", size), rest)
    assert memory(process) - before < 30, (before, memory(process))
    passed("announced lengths")


async def idle(process):
    """Many connections that say nothing, or nothing more, keep no client out."""
    crowd = []
    for at in range(400):
        one = socket.create_connection(("127.0.0.1", PORT), timeout=WAIT)
        if at % 2:
            one.sendall(hello())
        crowd.append(one)
    client = await connected(Basic, "anna", "correct horse")
    assert await value(client, "speed") is not None
    # Of each stranger that has to leave, the ends close a moment later.
    await awaits("few files", lambda: has_few_files(process))
    for one in crowd:
        one.close()
    assert await value(client, "speed") is not None
    await client.disconnect()
    passed("a crowd of strangers")


def open_without_encryption():
    """The request for a channel without encryption."""
    none = b"http://opcfoundation.org/UA/SecurityPolicy#None"
    header = struct.pack("<II", 0, len(none)) + none + struct.pack("<iiII", -1, -1, 1, 1)
    request = bytes([1, 0, 190, 1, 0, 0]) + struct.pack("<qIIiI", 0, 1, 0, -1, 0) + bytes(3)
    request += struct.pack("<IIIiI", 0, 0, 1, -1, 3_600_000)
    return b"OPNF" + struct.pack("<I", 8 + len(header) + len(request)) + header + request


def begin_of_encrypted():
    """The beginning of a request for a channel with encryption, which never ends."""
    policy = b"http://opcfoundation.org/UA/SecurityPolicy#Basic256Sha256"
    begun = b"OPNF" + struct.pack("<III", 16_384, 0, len(policy)) + policy
    return begun + bytes(271 - len(begun))


async def known():
    """Neither a request for a channel nor a certificate that nobody trusts takes a place of known clients."""
    crowd = []
    for _ in range(75):
        one = socket.create_connection(("127.0.0.1", PORT), timeout=WAIT)
        one.sendall(hello() + open_without_encryption() + begin_of_encrypted())
        answer = b""
        while b"OPNF" not in answer:
            piece = one.recv(65536)
            assert piece, answer
            answer += piece
        crowd.append(one)
    client = await connected(Basic, "anna", "correct horse")
    assert await value(client, "speed") is not None
    for one in crowd:
        one.close()
    make_certificate("a stranger")
    strangers = []
    for _ in range(75):
        stranger = Client(URL, timeout=SLOW)
        files = [str(FOLDER / f"a stranger.{ending}") for ending in ("der", "pem")]
        own = FOLDER / "pki/own/cert.der"
        await stranger.set_security(Basic, *files, server_certificate=str(own), mode=ENCRYPTED)
        await stranger.connect_socket()
        await stranger.send_hello()
        await stranger.open_secure_channel()
        strangers.append(stranger)
    second = await connected(Basic, "anna", "correct horse")
    assert await value(second, "speed") is not None
    await second.disconnect()
    for stranger in strangers:
        stranger.disconnect_socket()
    await client.disconnect()
    passed("places of known clients")


async def has_few_files(process):
    return len(os.listdir(f"/proc/{process.process.pid}/fd")) < 400


def timers():
    """The timers of the connections at the port of clients: (kind, seconds), kind 2 is a keepalive."""
    found = []
    for line in open("/proc/net/tcp").read().splitlines()[1:]:
        words = line.split()
        if words[1].endswith(f":{PORT:04X}") and words[3] == "01":
            kind, when = words[5].split(":")
            found.append((int(kind, 16), int(when, 16) / os.sysconf("SC_CLK_TCK")))
    return found


async def half_open():
    """The system asks a client that says nothing whether it is there: one that is gone without a word gives its
    place back. (That it is gone after two minutes is a test of the gate.)"""
    client = await connected(Basic, "anna", "correct horse")

    async def is_asked():
        # What is under way has another timer for a moment.
        return any(kind == 2 and when <= 30 for kind, when in timers())

    await awaits("a keepalive timer", is_asked)
    await client.disconnect()
    passed("half-open connections")


async def certificates():
    """A certificate that is over, and one with another name, are refused even if a person trusts them."""
    make_expired("an old client")
    await refused(Basic, "anna", "correct horse", name="an old client")
    trust("an old client")
    await refused(Basic, "anna", "correct horse", name="an old client")
    # The key is another one than that of the certificate.
    make_certificate("a thief")
    (FOLDER / "a thief.der").write_bytes((FOLDER / "a client.der").read_bytes())
    await refused(Basic, "anna", "correct horse", name="a thief")
    passed("wrong certificates")


async def replays():
    """What was recorded of a connection is worth nothing a second time, and neither is a nonce."""
    sent = bytearray()

    async def carry(reader, writer, keep):
        try:
            while piece := await reader.read(65536):
                keep.extend(piece)
                writer.write(piece)
                await writer.drain()
        except ConnectionError:
            pass
        writer.close()

    async def between(reader, writer):
        far_reader, far_writer = await asyncio.open_connection("127.0.0.1", PORT)
        await asyncio.gather(carry(reader, far_writer, sent), carry(far_reader, writer, bytearray()))

    proxy = await asyncio.start_server(between, "127.0.0.1", PORT + 5)
    client = await connected(Basic, "anna", "correct horse", url=f"opc.tcp://127.0.0.1:{PORT + 5}/")
    await tag(client, "speed").write_value(ua.Variant(5, ua.VariantType.Int32))
    await client.disconnect()
    proxy.close()
    rungd("write", "speed", "6")
    log = (FOLDER / "rungd.log").read_text().count("anna")
    assert log > 0 and len(sent) > 3000, len(sent)
    assert await asyncio.to_thread(closed, bytes(sent))
    assert '"value":6' in rungd("read", "speed", "--json").replace(" ", "")
    assert (FOLDER / "rungd.log").read_text().count("anna") == log

    nonce = os.urandom(32)
    fresh, asyncua.client.client.create_nonce = asyncua.client.client.create_nonce, lambda size: nonce[:size]
    try:
        client = await connected(Basic, "anna", "correct horse")
        is_refused = False
        try:
            await asyncio.wait_for(client.open_secure_channel(renew=True), SLOW)
        except (*CLOSED, AssertionError):
            # asyncua asserts that the answer is one.
            is_refused = True
        assert is_refused, "a nonce was taken twice"
    finally:
        asyncua.client.client.create_nonce = fresh
    await client.disconnect()
    passed("replays")


async def roles():
    """The roles of the controller file hold: `view` looks, `operate` writes, and not what only `service` writes."""
    ben = await connected(Basic, "ben", "battery staple")
    anna = await connected(Basic, "anna", "correct horse")
    before = await value(ben, "speed")
    await refused_with("UserAccessDenied", tag(ben, "speed").write_value(ua.Variant(9, ua.VariantType.Int32)))
    assert await value(anna, "speed") == before
    slots = ua.Variant([1, 2, 3, 4], ua.VariantType.Int32)
    await refused_with("UserAccessDenied", tag(anna, "slots").write_value(slots))
    await tag(anna, "speed").write_value(ua.Variant(7, ua.VariantType.Int32))
    timed = ua.NodeId(ua.ObjectIds.ShelvedStateMachineType_TimedShelve)
    shelve = ben.get_node(ua.NodeId("/alarms/trip", 2)).call_method(timed, ua.Variant(1e6, ua.VariantType.Double))
    await refused_with("UserAccessDenied", shelve)
    # A reason gives no right, and a right no reason.
    on = ua.Variant(True, ua.VariantType.Boolean)
    await refused_with("UserAccessDenied", write_with_reason(ben, "start", on, "Test"))
    await refused_with("BadNotWritable", tag(anna, "start").write_value(on))
    await refused_with("UserAccessDenied", write_with_reason(anna, "slots", slots, "Test"))
    await write_with_reason(anna, "start", on, "Start of the shift")

    async def is_logged():
        lines = (FOLDER / "rungd.log").read_text().splitlines()
        return any("anna" in line and "reason: Start of the shift" in line for line in lines)

    await awaits("the line with the reason", is_logged)
    for client in (ben, anna):
        await client.disconnect()
    passed("roles")


async def tries(process):
    """After five wrong passwords within a minute the right one is refused too, and other users are not."""
    for _ in range(5):
        await refused(Basic, "ben", "wrong password")
    await refused(Basic, "ben", "battery staple")
    log = process.log.read_text()
    assert "ben is refused: too many wrong passwords: wait a minute" in log, log
    client = await connected(Basic, "anna", "correct horse")
    await client.disconnect()
    passed("tries of passwords")


async def limits():
    """Sessions, subscriptions and monitored items have limits, and a session that ends makes room."""
    clients = [await connected(Basic, "anna", "correct horse") for _ in range(3)]
    error = await refused(Basic, "anna", "correct horse")
    assert "TooManySessions" in type(error).__name__, error
    await clients.pop().disconnect()
    clients.append(await connected(Basic, "anna", "correct horse"))
    client = clients[0]
    subscriptions = [await client.create_subscription(1000, Seen()) for _ in range(20)]
    try:
        await client.create_subscription(1000, Seen())
        raise AssertionError("more than 20 subscriptions")
    except ua.UaStatusCodeError as error:
        assert "TooManySubscriptions" in type(error).__name__, error
    node = tag(client, "level")
    for _ in range(20):
        await subscriptions[0].subscribe_data_change([node] * 1000, sampling_interval=3_600_000)
    try:
        await subscriptions[0].subscribe_data_change(node, sampling_interval=3_600_000)
        raise AssertionError("more than 20,000 monitored items")
    except ua.UaStatusCodeError as error:
        assert "TooManyMonitoredItems" in type(error).__name__, error
    passed("limits")
    for client in clients:
        await client.disconnect()


async def continuation_points():
    """What is left of a browse waits at few places, which a client can free."""
    client = await connected(Basic, "anna", "correct horse")
    params = ua.BrowseParameters(RequestedMaxReferencesPerNode=1)
    params.View.Timestamp = ua.get_win_epoch()
    params.NodesToBrowse = [ua.BrowseDescription(NodeId=ua.NodeId("/tags", 2), ResultMask=63)]
    points, results = [], []
    for _ in range(7):
        [result] = await client.uaclient.browse(params)
        results.append(result.StatusCode.name)
        points += [result.ContinuationPoint] if result.ContinuationPoint else []
    assert results == ["Good"] * 5 + ["BadNoContinuationPoints"] * 2, results
    assert len(points) == 5
    free = ua.BrowseNextParameters(ReleaseContinuationPoints=True, ContinuationPoints=points)
    await client.uaclient.browse_next(free)
    [result] = await client.uaclient.browse(params)
    assert result.StatusCode.is_good(), result
    params.NodesToBrowse = params.NodesToBrowse * 101
    await refused_with("TooManyOperations", client.uaclient.browse(params))
    await client.disconnect()
    passed("continuation points")


async def untrusted(thumbprint):
    """A client that is trusted no more cannot connect."""
    subprocess.run([OPCUA, "trust", "opcua.toml", "remove", thumbprint], cwd=FOLDER, check=True)
    await refused(Basic, "anna", "correct horse")
    passed("trust that is taken back")


async def main():
    write("ladder.toml", LADDER)
    write("t.toml", 'ladder = ["ladder.toml"]\noperator.socket = "t.sock"\n[scan]\nperiod = "2ms"\n'
          '[web]\nwrite = ["speed"]\nwrite-service = ["slots"]\n[[user]]\nname = "anna"\nrole = "operate"\n'
          '[[user]]\nname = "carl"\nrole = "service"\n'
          '[[panel]]\nname = "Start"\nshow = [{ value = "start", reason = true }]\n')
    settings("insecure = true")
    make_certificate("a client")
    try:
        running, serving = controller(), server()
        async with Client(URL, timeout=SLOW) as client:
            await awaits("good values", lambda: is_value(client, "speed", 0))
            await strangers(client)
        serving.end()
        for name, password in (("anna", "correct horse"), ("ben", "battery staple")):
            users = subprocess.run([RUNGD, "web", "passwd", name, "--users-file", "users"], cwd=FOLDER,
                                   input=f"{password}\n", capture_output=True, text=True)
            assert users.returncode == 0, users
        settings("", 'users-file = "users"')
        serving = server("secure.log")
        thumbprint = await secure()
        await without_encryption(serving)
        await lengths(serving)
        await roles()
        await tries(serving)
        await idle(serving)
        await known()
        await half_open()
        await certificates()
        await replays()
        await continuation_points()
        await untrusted(thumbprint)
        trust("a client")
        # Refused sign-ins have left sessions, each for a minute.
        serving.end()
        settings("sessions = 3", 'users-file = "users"')
        serving = server("limits.log")
        await limits()
    finally:
        end_all()


asyncio.run(main())
