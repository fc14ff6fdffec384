// The files that package.json names, and what files are recognized as.
'use strict';

const assert = require('node:assert');
const fs = require('node:fs');
const path = require('node:path');
const { languageOf } = require('../kinds');
const { base, manifest, read } = require('./base');

const tests = {};

tests['the files that package.json names are there, and JSON'] = () => {
    const { contributes } = manifest;
    const files = [...contributes.languages.map((one) => one.configuration),
        ...contributes.grammars.map((one) => one.path),
        ...contributes.snippets.map((one) => one.path)];
    for (const file of files.filter(Boolean)) read(file);
    for (const { icon } of contributes.languages.filter((one) => one.icon)) {
        for (const file of [icon.light, icon.dark]) {
            const icon = fs.readFileSync(path.join(base, file), 'utf8');
            assert.match(icon, /^<svg [^]*<\/svg>\n$/);
        }
    }
    const cargo = fs.readFileSync(path.join(base, '../../Cargo.toml'), 'utf8');
    assert.strictEqual(manifest.version, /^version\s*=\s*"(.*)"/m.exec(cargo)[1]);
    assert.match(manifest.dependencies['vscode-languageclient'], /^\d/);
};

tests['the patterns of the grammar are what JavaScript reads too'] = () => {
    const walk = (value) => {
        if (value === null || typeof value !== 'object') return;
        for (const key of ['match', 'begin', 'end']) if (value[key]) new RegExp(value[key]);
        Object.values(value).forEach(walk);
    };
    const grammar = read('toml.tmLanguage.json');
    walk(grammar);
    const { key, header } = grammar.repository;
    assert.strictEqual(new RegExp(key.match).exec('leg.up  = ["X0"]')[1], 'leg.up');
    assert.strictEqual(new RegExp(key.match).exec('"p1.x" = 3')[1], '"p1.x"');
    assert.strictEqual(new RegExp(header.match).exec('[[program.rung]] # x')[2], 'program.rung');
};

tests['files are recognized by their tables'] = () => {
    const cases = [
        ['a.test.toml', '', 'rungd-test'],
        ['a.toml', '', null],
        ['a.toml', '# a comment\n', null],
        ['a.toml', '[ladder]\nname = "x"\n', 'rungd-ladder'],
        ['a.toml', 'ladder.name = "x"\n', 'rungd-ladder'],
        ['a.toml', '[[program.rung]]\nwhen = ["\n', 'rungd-ladder'],
        ['a.toml', '[tags]\r\na = {\r\n', 'rungd-ladder'],
        ['a.toml', '[[template]]\n', 'rungd-ladder'],
        ['a.toml', 'ladder = ["x.toml"]\n[scan]\n', 'rungd-controller'],
        ['a.toml', '[[simulated-device]]\ninput = "X0"\n', 'rungd-controller'],
        ['a.toml', 'ladder = ["x"]\n[[scenario]]\n', 'rungd-test'],
        ['Cargo.toml', '[package]\nname = "x"\n[[bin]]\n', 'toml'],
        ['a.toml', 'a = [\n    [1, 2],\n    ["program"],\n]\n', 'toml'],
        ['a.toml', '[tool.x]\nprogram = 1\n', 'toml'],
    ];
    for (const [name, text, language] of cases) {
        assert.strictEqual(languageOf(name, text), language, `${name}: ${text}`);
    }
    const config = path.join(base, '../../config');
    const expected = { '.': /^rungd-(controller|ladder)$/, programs: /^rungd-ladder$/,
        lib: /^rungd-ladder$/, tests: /^rungd-/ };
    for (const [folder, language] of Object.entries(expected)) {
        const names = fs.readdirSync(path.join(config, folder));
        for (const name of names.filter((one) => one.endsWith('.toml'))) {
            const text = fs.readFileSync(path.join(config, folder, name), 'utf8');
            assert.match(languageOf(name, text), language, name);
        }
    }
};

module.exports = tests;
