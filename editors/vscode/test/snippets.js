// Each snippet, as it stands when nobody types over its places, is what rungd accepts.
'use strict';

const assert = require('node:assert');
const { spawnSync } = require('node:child_process');
const fs = require('node:fs');
const os = require('node:os');
const path = require('node:path');
const { read, rungd } = require('./base');

// A place: `${1:text}` or `${1|first,second|}`.
const PLACE = /\$\{(\d+)(?::((?:\\.|[^}\\])*)|\|([^,|]*)[^|]*\|)\}/g;

const tests = {};

// What stands in a file when nobody types over the places of a snippet.
function expanded(body) {
    const defaults = {};
    let text = body.join('\n').replace(/\n?\$0$/, '\n');
    text = text.replace(PLACE, (_, at, plain, choice) => {
        defaults[at] = defaults[at] ?? (plain ?? choice);
        return defaults[at];
    });
    assert.doesNotMatch(text, /(?<!\\)\$/, text);
    return text.replace(/\\([$}\\])/g, '$1');
}

const rung = (contact, output) => (
    `[[program.rung]]\nwhen = ["${contact}"]\ndo   = ["OUT ${output}"]\n`
);
const MAIN_PROGRAM = `[[program]]\nname = "Main"\n\n${rung('X7', 'Y7')}`;
const PUMP = `[[template]]
name = "Pump"

[template.parameters]
wanted = { type = "contact" }
motor  = { type = "output" }

[[template.rung]]
when = ["wanted"]
do   = ["OUT motor"]
`;
const TAGS = ['[tags]\n', `\n${MAIN_PROGRAM}`];

// What a snippet needs around it to be a whole file, by its prefix ('': all others): what stands
// before it, and behind.
const AROUND = {
    ladder: {
        ladder: [''],
        branch: [MAIN_PROGRAM],
        stage: [`${MAIN_PROGRAM}\n[[program]]\nname = "P"\n\n`],
        use: [`${PUMP}\n${MAIN_PROGRAM}\n`],
        tag: TAGS,
        'tag-type': TAGS,
        alarm: TAGS,
        '': [`${MAIN_PROGRAM}\n`],
    },
    controller: { controller: [''], '': ['ladder = ["programs/main.toml"]\n\n'] },
    test: { test: [''], '': ['ladder = ["ladder.toml"]\n\n'] },
    files: { '': [''] },
};

function run(folder, ...args) {
    const done = spawnSync(rungd, args, { cwd: folder, encoding: 'utf8' });
    if (done.error) throw done.error;
    return done;
}

function trySnippet(folder, kind, { prefix, body }) {
    const frames = AROUND[kind];
    const [before, behind = ''] = frames[prefix] || frames[''];
    const text = before + expanded(body) + behind;
    const isTest = kind === 'test' || prefix === 'rungd-test';
    const name = isTest ? 'snippet.test.toml' : 'snippet.toml';
    fs.writeFileSync(path.join(folder, name), text);
    const judged = isTest ? run(folder, 'test', name) : run(folder, 'check', name);
    assert.strictEqual(judged.status, 0, `${prefix}:\n${text}\n${judged.stdout}${judged.stderr}`);
    const layout = run(folder, 'fmt', '--check', name);
    assert.strictEqual(layout.status, 0, `${prefix}:\n${layout.stdout}${layout.stderr}`);
}

tests['each snippet is a text that rungd accepts, in its layout'] = () => {
    const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'rungd-vscode-'));
    const ladder = [MAIN_PROGRAM, rung('X0', 'Y0'), rung('X1', 'C0')].join('\n');
    fs.mkdirSync(path.join(folder, 'programs'));
    fs.writeFileSync(path.join(folder, 'programs/main.toml'), ladder);
    fs.writeFileSync(path.join(folder, 'ladder.toml'), ladder);
    let count = 0;
    for (const kind of Object.keys(AROUND)) {
        for (const snippet of Object.values(read(`snippets/${kind}.json`))) {
            trySnippet(folder, kind, snippet);
            count += 1;
        }
    }
    assert.ok(count > 25, `${count} snippets`);
    fs.rmSync(folder, { recursive: true });
};

module.exports = tests;
