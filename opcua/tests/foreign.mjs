// A second foreign OPC UA client (node-opcua) against `rungd-opcua` and running controllers.
//
// Usage: node foreign.mjs RUNGD RUNGD_OPCUA CONFIG FOLDER, where `node-opcua-client` can be found from
// the working folder. CONFIG is the folder of the shipped plants. Each passed part is a line `ok NAME`.
// .ci/nightly calls it. Nothing depends on the machine's speed: WAIT only ends a test that hangs.

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const require = createRequire(path.join(process.cwd(), "package.json"));
const opcua = require("node-opcua-client");

const [RUNGD, OPCUA, CONFIG, FOLDER] = process.argv.slice(2).map((one) => path.resolve(one));
const PORT = Number(process.env.OPCUA_PORT ?? 48412);
const URL = `opc.tcp://127.0.0.1:${PORT}/`;
const WAIT = Number(process.env.WAIT ?? 120_000);

const LADDER = `
[ladder]
name = "t"
[tags]
start = { type = "bit" }
fast  = { type = "int" }
trip  = { type = "bit", alarm = "The drive has tripped" }
[[program]]
name = "Main"
[[program.rung]]
when = ["start"]
do   = ["MATH fast = fast + 1"]
`;

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

async function awaits(what, condition) {
  const end = Date.now() + WAIT;
  for (;;) {
    const value = await condition();
    if (value) return value;
    assert(Date.now() < end, typeof what === "string" ? what : what());
    await sleep(50);
  }
}

/** A process whose output is a file of the folder. */
class Process {
  static running = new Set();
  constructor(words, log) {
    this.log = path.join(FOLDER, log);
    const out = fs.openSync(this.log, "w");
    this.child = spawn(words[0], words.slice(1), { cwd: FOLDER, stdio: ["ignore", out, out] });
    this.over = new Promise((resolve) => this.child.on("exit", resolve));
    Process.running.add(this);
  }
  async says(text) {
    await awaits(`${text} in ${this.log}`, () => {
      const said = fs.readFileSync(this.log, "utf8");
      assert(this.child.exitCode === null, said);
      return said.includes(text);
    });
    return this;
  }
  async end(how = "SIGTERM") {
    this.child.kill(how);
    await this.over;
    Process.running.delete(this);
  }
}

function rungd(...words) {
  const all = [...words, "--socket", path.join(FOLDER, "t.sock")];
  return execFileSync(RUNGD, all, { cwd: FOLDER, encoding: "utf8", timeout: WAIT });
}

/** Values by `rungd read`; of an output what it is driven to. */
function values(names) {
  const values = JSON.parse(rungd("read", ...names, "--json")).values;
  const by = new Map(values.flatMap((one) => [one.tag, one.operand].map((name) => [name, one.driven ?? one.value])));
  return names.map((name) => by.get(name));
}

function settings(write) {
  fs.writeFileSync(path.join(FOLDER, "opcua.toml"), `
[server]
name = "t"
listen = "127.0.0.1:${PORT}"
certificates = "pki"
insecure = true
[controller]
socket = "t.sock"
[tags]
write = ${JSON.stringify(write)}
[alarms]
shelve = true
`);
}

const controller = (file) => new Process([RUNGD, "run", file], "rungd.log").says("INFO");
const server = () => new Process([OPCUA, "opcua.toml"], "opcua.log").says("the controller at t.sock answers");

async function connected(use) {
  const client = opcua.OPCUAClient.create({
    endpointMustExist: false,
    keepSessionAlive: true,
    connectionStrategy: { initialDelay: 100, maxDelay: 1000, maxRetry: -1 },
  });
  await client.connect(URL);
  const session = await client.createSession();
  try {
    return await use(session, client);
  } finally {
    await session.close().catch(() => {});
    await client.disconnect();
  }
}

/** All variables below the tags of the program, as name and node id. */
async function browse(session) {
  const found = new Map();
  const walk = async (nodeId) => {
    const { references } = await session.browse({
      nodeId, browseDirection: opcua.BrowseDirection.Forward, includeSubtypes: true,
      referenceTypeId: opcua.resolveNodeId("HierarchicalReferences"), nodeClassMask: 0, resultMask: 63,
    });
    for (const one of references ?? []) {
      const id = one.nodeId;
      if (id.namespace !== 2 || typeof id.value !== "string" || found.has(id.value)) continue;
      const isVariable = one.nodeClass === opcua.NodeClass.Variable;
      found.set(id.value, isVariable);
      await walk(id);
    }
  };
  await walk(opcua.coerceNodeId("ns=2;s=/tags"));
  return [...found].filter(([name, isVariable]) => isVariable && !name.includes("/")).map(([name]) => name);
}

const idOf = (name) => opcua.makeNodeId(name, 2);

async function read(session, names) {
  const nodes = names.map((name) => ({ nodeId: idOf(name), attributeId: opcua.AttributeIds.Value }));
  return (await session.read(nodes)).map((one) => one.value.value);
}

/** A subscription of one value, with every change of it. */
async function monitored(session, name, queueSize) {
  const subscription = await session.createSubscription2({
    requestedPublishingInterval: 100, requestedLifetimeCount: 6000, requestedMaxKeepAliveCount: 10,
    maxNotificationsPerPublish: 0, publishingEnabled: true, priority: 1,
  });
  const item = await subscription.monitor(
    { nodeId: idOf(name), attributeId: opcua.AttributeIds.Value },
    { samplingInterval: 0, queueSize, discardOldest: true }, opcua.TimestampsToReturn.Both,
  );
  return { subscription, item };
}

/** Whether a value of OPC UA is that of `rungd read`. */
function isSame(got, shown) {
  if (got === null || got === undefined) return false;
  // An array's elements are not compared: its name alone stands for them in `rungd read`.
  if (ArrayBuffer.isView(got) || Array.isArray(got)) return true;
  if (shown === undefined) return false;
  return Math.abs(Number(got) - Number(shown)) <= 1e-6 * Math.max(1, Math.abs(Number(shown)));
}

/** Every shipped plant: the names are those of its tags, the values those of `rungd read`. */
async function plants() {
  const folder = path.join(FOLDER, "config");
  fs.cpSync(CONFIG, folder, { recursive: true });
  const files = fs.readdirSync(folder).filter((name) => name.endsWith(".toml"));
  let tags = 0;
  for (const file of files) {
    const copy = path.join("config", file);
    const text = fs.readFileSync(path.join(FOLDER, copy), "utf8");
    fs.writeFileSync(path.join(FOLDER, copy), text.replace(/^operator.socket = .*$/m, `operator.socket = ${JSON.stringify(path.join(FOLDER, "t.sock"))}`));
    const running = await controller(copy);
    const serving = await server();
    await connected(async (session) => {
      const names = await awaits(`tags of ${file}`, async () => {
        const names = await browse(session);
        return names.length > 0 && names;
      });
      // What `rungd read` writes into a file are all tags that can be written.
      const written = rungd("read", "--file", "-").matchAll(/^"?([A-Za-z_][\w]*)/gm);
      const heads = new Set(names.map((name) => name.split(/[.[]/)[0]));
      const known = new Set(names);
      for (const [, name] of written) {
        if (name === "mode" || name === "scan") continue;
        assert(known.has(name) || heads.has(name), `${file}: ${name} of \`rungd read\` is no node`);
      }
      // Without scans no value moves; the last ones may still be under way.
      rungd("mode", "stop");
      const shown = values(names);
      let other = [];
      await awaits(() => `equal values of ${file}: ${other}`, async () => {
        const got = await read(session, names);
        const both = names.map((name, at) => ({ name, got: got[at], shown: shown[at] }));
        other = both.filter((one) => !isSame(one.got, one.shown)).map((one) => JSON.stringify(one));
        return other.length === 0;
      });
      tags += names.length;
    });
    await serving.end();
    await running.end();
  }
  console.log(`ok tags of ${files.length} plants, ${tags} values`);
}

/** Every scan's change reaches a monitored item, and the history has the same. */
async function changes() {
  const got = [];
  await connected(async (session) => {
    const { subscription, item } = await monitored(session, "fast", 10_000);
    item.on("changed", (data) => got.push([data.value.value, data.sourceTimestamp, data.sourcePicoseconds]));
    const begin = new Date(Date.now() - 60_000);
    const on = (value) => session.write({
      nodeId: idOf("start"), attributeId: opcua.AttributeIds.Value,
      value: { value: { dataType: opcua.DataType.Boolean, value } },
    });
    assert((await on(true)).isGood());
    await awaits("5000 changes", () => got.length > 5000);
    assert((await on(false)).isGood());
    const [last] = values(["fast"]);
    await awaits("the last change", () => got.at(-1)[0] === last);
    const first = got[0][0];
    assert.deepEqual(got.map(([value]) => value), Array.from({ length: got.length }, (_, at) => first + at));
    await subscription.terminate();

    const past = await awaits("the whole past", async () => {
      const answer = await session.readHistoryValue(idOf("fast"), begin, new Date(Date.now() + 1000));
      const data = answer.historyData?.dataValues ?? [];
      return data.length > 0 && data.at(-1).value.value === last && data.map((one) => one.value.value);
    });
    assert.deepEqual(past, Array.from({ length: past.length }, (_, at) => past[0] + at));
    console.log(`ok ${got.length} changes, none lost, and as many of the past: ${past.length}`);
  });
}

/** The methods of shelves. */
async function shelves() {
  await connected(async (session) => {
    const call = async (method, ...inputArguments) => {
      const objectId = idOf("/alarms/trip");
      return (await session.call({ objectId, methodId: opcua.resolveNodeId(method), inputArguments })).statusCode.name;
    };
    const shelf = () => JSON.parse(rungd("alarms", "--json")).alarms.find((one) => one.tag === "trip")?.shelved?.why;
    const hour = { dataType: opcua.DataType.Double, value: 3_600_000 };
    const text = { dataType: opcua.DataType.LocalizedText, value: { text: "New bearing" } };
    assert.equal(await call("ShelvedStateMachineType_Unshelve"), "BadConditionNotShelved");
    assert.equal(await call("ns=0;i=24756", hour, text), "Good");
    assert.equal(shelf(), "New bearing");
    assert.equal(await call("ShelvedStateMachineType_OneShotShelve"), "BadNotImplemented");
    assert.equal(await call("ShelvedStateMachineType_Unshelve"), "Good");
    assert.equal(shelf(), undefined);
  });
  console.log("ok shelves");
}

/** A client that stays finds its subscription again after kill -9 of the server and of the controller. */
async function returns(running, serving) {
  await connected(async (session, client) => {
    const got = [];
    const { item } = await monitored(session, "/status/Mode", 10);
    item.on("changed", (data) => got.push(data.statusCode.name));
    await awaits("a first value", () => got.at(-1) === "Good");
    await running.end("SIGKILL");
    await awaits(() => `a bad value: ${got.slice(-5)}`, () => got.at(-1) === "BadNoCommunication");
    running = await controller("t.toml");
    await awaits("a good value", () => got.at(-1) === "Good");
    let reconnected = false;
    client.on("connection_reestablished", () => { reconnected = true; });
    await serving.end("SIGKILL");
    const before = got.length;
    serving = await server();
    await awaits("the connection", () => reconnected);
    await awaits("a value after it", () => got.length > before && got.at(-1) === "Good");
    console.log("ok kill -9 of the controller and of the server");
  });
  return [running, serving];
}

let code = 0;
try {
  settings([]);
  await plants();
  settings(["start"]);
  fs.writeFileSync(path.join(FOLDER, "ladder.toml"), LADDER);
  fs.writeFileSync(path.join(FOLDER, "t.toml"), 'ladder = ["ladder.toml"]\noperator.socket = "t.sock"\n[scan]\nperiod = "1ms"\n');
  let [running, serving] = [await controller("t.toml"), await server()];
  await changes();
  await shelves();
  [running, serving] = await returns(running, serving);
  await serving.end();
  await running.end();
} catch (error) {
  console.error(error);
  code = 1;
}
for (const one of Process.running) one.child.kill("SIGKILL");
process.exit(code);
