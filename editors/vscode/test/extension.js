// What the extension registers and starts, by a stub of VS Code's interface.
'use strict';

const assert = require('node:assert');
const Module = require('node:module');
const { bundle, manifest } = require('./base');

const tests = {};

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
function stub(settings, seen, shown, remoteName) {
    const event = (name) => (hear) => { seen.events[name] = hear; return { dispose() {} }; };
    return Object.assign(anything(), {
        env: { remoteName },
        workspace: Object.assign(anything(), {
            getConfiguration: () => ({ get: (key) => settings[key] }),
            createFileSystemWatcher: (pattern) => ({ pattern }),
            onDidOpenTextDocument: event('open'),
            onDidSaveTextDocument: event('save'),
            onDidChangeConfiguration: event('configuration'),
            textDocuments: shown,
        }),
        window: Object.assign(anything(), {
            showErrorMessage: async (text, choice) => {
                seen.errors.push(text);
                return choice;
            },
            activeTextEditor: {
                document: { uri: { toString: () => 'file:///x/a.toml' } },
                selection: { active: { line: 3, character: 7 } },
            },
        }),
        commands: Object.assign(anything(), {
            registerCommand: (name, does) => {
                seen.commands[name] = does;
                return { dispose() {} };
            },
            executeCommand: (...all) => { seen.executed.push(all); },
        }),
        languages: Object.assign(anything(), {
            setTextDocumentLanguage: (document, language) => { seen.languages.push(language); },
        }),
    });
}

// A text that VS Code shows.
function shows(languageId, text, scheme = 'file') {
    return { languageId, getText: () => text, uri: { scheme, path: '/x/a.toml' } };
}

const LADDER = shows('rungd-ladder', '[[program]]\n');

function loaded(settings, shown = [LADDER], failure = undefined, remoteName = undefined) {
    const seen = { events: {}, commands: {}, executed: [], languages: [], errors: [], clients: [] };
    class LanguageClient {
        constructor(id, name, server, options) {
            this.calls = [];
            seen.clients.push({ server, options, calls: this.calls });
        }

        async start() {
            this.calls.push('start');
            if (failure) throw failure;
        }

        async stop() {
            this.calls.push('stop');
        }
    }
    const own = Module._load;
    const code = stub(settings, seen, shown, remoteName);
    Module._load = (name, ...rest) => {
        if (name === 'vscode') return code;
        if (name === 'vscode-languageclient/node') return { LanguageClient };
        return own(name, ...rest);
    };
    delete require.cache[require.resolve('../extension.js')];
    try {
        return { seen, extension: require('../extension.js') };
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
    const all = seen.clients.map((one) => one.calls.join(' '));
    assert.deepStrictEqual(all, ['start stop', 'start stop']);
};

tests['a program that is not there is said, with the setting'] = async () => {
    const settings = (remote) => remote
        ? ['workbench.action.openRemoteSettings', { query: 'rungd.path' }]
        : ['workbench.action.openSettings', 'rungd.path'];
    // The client rejects with a text where the program is not there.
    for (const failure of [new Error('spawn rungd ENOENT'), 'spawn rungd ENOENT']) {
        for (const remote of [undefined, 'ssh-remote']) {
            const { seen, extension } = loaded({}, [LADDER], failure, remote);
            await extension.activate({ subscriptions: [] });
            assert.match(seen.errors[0], /does not start: spawn rungd ENOENT/);
            assert.deepStrictEqual(seen.executed, [settings(remote)]);
            seen.events.open(LADDER);
            assert.strictEqual(seen.errors.length, 1);
            await extension.deactivate();
        }
    }
};

tests['it gives files their language, once'] = async () => {
    const { seen, extension } = loaded({}, []);
    await extension.activate({ subscriptions: [] });
    const open = (...what) => {
        const before = seen.languages.length;
        seen.events.open(shows(...what));
        return seen.languages.slice(before)[0];
    };
    assert.strictEqual(open('toml', '[package]\n'), undefined);
    assert.strictEqual(open('rungd-controller', '[package]\n'), 'toml');
    assert.strictEqual(open('toml', '[[program]]\n'), 'rungd-ladder');
    assert.strictEqual(seen.clients.length, 0);
    assert.strictEqual(open('rungd-ladder', '[[program]]\n'), undefined);
    assert.strictEqual(seen.clients.length, 1);
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

if (bundle) {
    tests['the bundle loads, with the real client'] = () => {
        const own = Module._load;
        const code = stub({}, { events: {}, commands: {} }, []);
        code.version = '1.90.0';
        Module._load = (name, ...rest) => (name === 'vscode' ? code : own(name, ...rest));
        try {
            assert.strictEqual(typeof require(bundle).activate, 'function');
        } finally {
            Module._load = own;
        }
    };
}

module.exports = tests;
