// Tests of the extension, in plain node: `node test.js RUNGD [MAIN]`. RUNGD is the program; MAIN is
// what VS Code would load (extension.js here, the bundle in package.sh). Without VS Code: a stub of
// its interface says what the extension registers.
'use strict';

const assert = require('node:assert');
const { spawnSync } = require('node:child_process');
const fs = require('node:fs');
const Module = require('node:module');
const os = require('node:os');
const path = require('node:path');

const rungd = path.resolve(process.argv[2]);
const main = path.resolve(process.argv[3] || path.join(__dirname, 'extension.js'));
const read = (name) => JSON.parse(fs.readFileSync(path.join(__dirname, name), 'utf8'));
const manifest = read('package.json');

const tests = {};

tests['the files that package.json names are there, and JSON'] = () => {
    const { contributes } = manifest;
    const files = [...contributes.languages.map((one) => one.configuration),
        ...contributes.grammars.map((one) => one.path),
        ...contributes.snippets.map((one) => one.path)];
    for (const file of files.filter(Boolean)) read(file);
    for (const { icon } of contributes.languages.filter((one) => one.icon)) {
        for (const file of [icon.light, icon.dark]) {
            assert.match(fs.readFileSync(path.join(__dirname, file), 'utf8'), /^<svg [^]*<\/svg>\n$/);
        }
    }
    const cargo = fs.readFileSync(path.join(__dirname, '../../Cargo.toml'), 'utf8');
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

// ---- The kinds of files --------------------------------------------------------------------------

tests['files are recognized by their tables'] = () => {
    const { languageOf } = require('./kinds');
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
    const config = path.join(__dirname, '../../config');
    const expected = { '.': 'rungd-controller', programs: 'rungd-ladder', lib: 'rungd-ladder', tests: null };
    for (const [folder, language] of Object.entries(expected)) {
        for (const name of fs.readdirSync(path.join(config, folder))) {
            if (!name.endsWith('.toml')) continue;
            const found = languageOf(name, fs.readFileSync(path.join(config, folder, name), 'utf8'));
            if (folder === '.') assert.match(found, /^rungd-(controller|ladder)$/, name);
            else if (language) assert.strictEqual(found, language, name);
            else assert.match(found, /^rungd-/, name);
        }
    }
};

// ---- The snippets --------------------------------------------------------------------------------

// What stands in a file when nobody types over the places of a snippet.
function expanded(body) {
    const defaults = {};
    let text = body.join('\n').replace(/\n?\$0$/, '\n');
    text = text.replace(/\$\{(\d+)(?::((?:\\.|[^}\\])*)|\|([^,|]*)[^|]*\|)\}/g, (_, at, plain, choice) => {
        defaults[at] = defaults[at] ?? (plain ?? choice);
        return defaults[at];
    });
    assert.doesNotMatch(text, /(?<!\\)\$/, text);
    return text.replace(/\\([$}\\])/g, '$1');
}

const MAIN_PROGRAM = '[[program]]\nname = "Main"\n\n[[program.rung]]\nwhen = ["X7"]\ndo   = ["OUT Y7"]\n\n';
const STAGES = '[[program]]\nname = "P"\n\n';
const PUMP = '[[template]]\nname = "Pump"\n\n[template.parameters]\nwanted = { type = "contact" }\n'
    + 'motor  = { type = "output" }\n\n[[template.rung]]\nwhen = ["wanted"]\ndo   = ["OUT motor"]\n\n';
const CONTROLLER = 'ladder = ["programs/main.toml"]\n\n';

// What a snippet needs around it to be a whole file: what stands before, and behind.
const AROUND = {
    ladder: { ladder: [''], branch: [MAIN_PROGRAM.trimEnd() + '\n'], stage: [MAIN_PROGRAM + STAGES], use: [PUMP + MAIN_PROGRAM],
        tag: ['[tags]\n', `\n${MAIN_PROGRAM.trimEnd()}\n`], 'tag-type': ['[tags]\n', `\n${MAIN_PROGRAM.trimEnd()}\n`],
        alarm: ['[tags]\n', `\n${MAIN_PROGRAM.trimEnd()}\n`], '': [MAIN_PROGRAM] },
    controller: { controller: [''], '': [CONTROLLER] },
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
    const ladder = MAIN_PROGRAM
        + '[[program.rung]]\nwhen = ["X0"]\ndo   = ["OUT Y0"]\n\n[[program.rung]]\nwhen = ["X1"]\ndo   = ["OUT C0"]\n';
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

// ---- The extension, with a stub of VS Code -------------------------------------------------------

// Anything that is asked for: a class, a function, an object.
function anything() {
    const shape = class {};
    return new Proxy(shape, {
        get: (target, key) => {
            if (key === 'prototype' || key in target || typeof key === 'symbol') return target[key];
            target[key] = anything();
            return target[key];
        },
        apply: () => anything(),
    });
}

// VS Code, as far as the extension uses it.
function stub(settings, seen) {
    const event = (name) => (hear) => { seen.events[name] = hear; return { dispose() {} }; };
    return Object.assign(anything(), {
        workspace: Object.assign(anything(), {
            getConfiguration: () => ({ get: (key) => settings[key] }),
            createFileSystemWatcher: (pattern) => ({ pattern }),
            onDidOpenTextDocument: event('open'),
            onDidSaveTextDocument: event('save'),
            onDidChangeConfiguration: event('configuration'),
            textDocuments: [],
        }),
        window: Object.assign(anything(), {
            showErrorMessage: async (text) => { seen.errors.push(text); },
            activeTextEditor: {
                document: { uri: { toString: () => 'file:///x/a.toml' } },
                selection: { active: { line: 3, character: 7 } },
            },
        }),
        commands: Object.assign(anything(), {
            registerCommand: (name, does) => { seen.commands[name] = does; return { dispose() {} }; },
            executeCommand: (...all) => { seen.executed.push(all); },
        }),
        languages: Object.assign(anything(), {
            setTextDocumentLanguage: (document, language) => { seen.languages.push(language); },
        }),
    });
}

function loaded(settings, fails) {
    const seen = { events: {}, commands: {}, executed: [], languages: [], errors: [], clients: [] };
    class LanguageClient {
        constructor(id, name, server, options) { seen.clients.push({ id, server, options, calls: [] }); }
        async start() { seen.clients.at(-1).calls.push('start'); if (fails) throw new Error('ENOENT'); }
        async stop() { seen.clients.at(-1).calls.push('stop'); }
    }
    const own = Module._load;
    const code = stub(settings, seen);
    Module._load = (name, ...rest) => {
        if (name === 'vscode') return code;
        if (name === 'vscode-languageclient/node') return { LanguageClient };
        return own(name, ...rest);
    };
    delete require.cache[require.resolve('./extension.js')];
    try {
        return { seen, extension: require('./extension.js') };
    } finally {
        Module._load = own;
    }
}

tests['it starts `rungd lsp` for the files of rungd, with its settings'] = async () => {
    const { seen, extension } = loaded({ path: '/opt/rungd', live: true, socket: '/run/x' });
    await extension.activate({ subscriptions: [] });
    const [{ server, options, calls }] = seen.clients;
    assert.deepStrictEqual(server, { command: '/opt/rungd', args: ['lsp'] });
    assert.deepStrictEqual(calls, ['start']);
    const languages = options.documentSelector.map((one) => one.language);
    const own = manifest.contributes.languages.map((one) => one.id).filter((id) => id !== 'toml');
    assert.deepStrictEqual(languages, own);
    assert.deepStrictEqual(options.initializationOptions(), { live: true, socket: '/run/x' });
    seen.events.configuration({ affectsConfiguration: () => false });
    seen.events.configuration({ affectsConfiguration: (name) => name === 'rungd.path' });
    await new Promise(setImmediate);
    assert.strictEqual(seen.clients.length, 2);
    await extension.deactivate();
    assert.deepStrictEqual(seen.clients.map((one) => one.calls), [['start', 'stop'], ['start', 'stop']]);
};

tests['a program that is not there is said, with the setting'] = async () => {
    const { seen, extension } = loaded({}, true);
    await extension.activate({ subscriptions: [] });
    assert.match(seen.errors[0], /does not start: ENOENT/);
    await extension.deactivate();
};

tests['it gives files their language, once'] = async () => {
    const { seen, extension } = loaded({});
    await extension.activate({ subscriptions: [] });
    const open = (languageId, text, scheme = 'file') => {
        const before = seen.languages.length;
        seen.events.open({ languageId, getText: () => text, uri: { scheme, path: '/x/a.toml' } });
        return seen.languages.slice(before)[0];
    };
    assert.strictEqual(open('toml', '[[program]]\n'), 'rungd-ladder');
    assert.strictEqual(open('rungd-ladder', '[[program]]\n'), undefined);
    assert.strictEqual(open('rungd-controller', '[package]\n'), 'toml');
    assert.strictEqual(open('toml', '[package]\n'), undefined);
    assert.strictEqual(open('rungd-ladder', ''), undefined);
    assert.strictEqual(open('markdown', '[[program]]\n'), undefined);
    assert.strictEqual(open('toml', '[[program]]\n', 'git'), undefined);
    await extension.deactivate();
};

tests['commands of the palette give the file and the cursor'] = async () => {
    const { seen, extension } = loaded({});
    await extension.activate({ subscriptions: [] });
    const own = manifest.contributes.commands.map((one) => one.command);
    // The client registers the server's own.
    const servers = ['rungd.live.on', 'rungd.live.off'];
    const registered = Object.keys(seen.commands).concat(servers).sort();
    assert.deepStrictEqual(registered, own.sort());
    seen.commands['rungd.here.test']();
    seen.commands['rungd.here.why']();
    assert.deepStrictEqual(seen.executed, [
        ['rungd.test', 'file:///x/a.toml'],
        ['rungd.why', 'file:///x/a.toml', { line: 3, character: 7 }],
    ]);
    await extension.deactivate();
};

if (main !== path.join(__dirname, 'extension.js')) {
    tests['the bundle loads, with the real client'] = () => {
        const own = Module._load;
        const code = stub({}, { events: {}, commands: {} });
        code.version = '1.90.0';
        Module._load = (name, ...rest) => (name === 'vscode' ? code : own(name, ...rest));
        try {
            assert.strictEqual(typeof require(main).activate, 'function');
        } finally {
            Module._load = own;
        }
    };
}

(async () => {
    for (const [name, test] of Object.entries(tests)) {
        await test();
        console.log(`ok: ${name}`);
    }
})().catch((failure) => {
    console.error(failure);
    process.exit(1);
});
