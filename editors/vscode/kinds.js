// Tells the files of rungd from other TOML files, and from each other, by their name and by the
// tables in the text. Called by extension.js. It follows src/source/file_kind.rs, but reads lines:
// a file that is being typed is rarely TOML.
'use strict';

const TEST = ['always', 'scenario', 'random', 'prove'];
const LADDER = ['program', 'task', 'template'];
const CONTROLLER = ['scan', 'realtime', 'outputs', 'retain', 'reload', 'modbus-server',
    'simulated-device', 'device', 'operator'];

// The keys of the root, and those of them that are tables.
function rootKeys(text) {
    const keys = new Set();
    const tables = new Set();
    let isRoot = true;
    for (const line of text.split(/\r\n|\r|\n/)) {
        const header = /^\s*\[\[?\s*([A-Za-z0-9_-]+)/.exec(line);
        const pair = isRoot && /^\s*([A-Za-z0-9_-]+)\s*([.=])/.exec(line);
        if (header && !/^\s*\[\s*\d/.test(line)) {
            isRoot = false;
            keys.add(header[1]);
            tables.add(header[1]);
        } else if (pair) {
            keys.add(pair[1]);
            if (pair[2] === '.') tables.add(pair[1]);
        }
    }
    return { keys, tables };
}

// The language of a file: `toml` if it is none of rungd, `null` if nothing says what it is.
function languageOf(path, text) {
    if (path.endsWith('.test.toml')) return 'rungd-test';
    const { keys, tables } = rootKeys(text);
    const has = (names) => names.some((name) => keys.has(name));
    if (keys.size === 0) return null;
    if (has(LADDER) || tables.has('tags') || tables.has('ladder')) return 'rungd-ladder';
    if (has(TEST)) return 'rungd-test';
    if (keys.has('ladder') || has(CONTROLLER)) return 'rungd-controller';
    return 'toml';
}

module.exports = { languageOf };
