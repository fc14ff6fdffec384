// What the tests share: the program, the bundle, the extension's files.
'use strict';

const fs = require('node:fs');
const path = require('node:path');

const base = path.join(__dirname, '..');
const read = (name) => JSON.parse(fs.readFileSync(path.join(base, name), 'utf8'));
const [rungd, bundle] = process.argv.slice(2).map((name) => path.resolve(name));

module.exports = { base, bundle, manifest: read('package.json'), read, rungd };
