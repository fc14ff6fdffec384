// Starts `rungd lsp` for the files of rungd, and tells VS Code which files those are. All answers
// are the server's; nothing is known here of ladders.
'use strict';

const vscode = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');
const { languageOf } = require('./kinds');

const LANGUAGES = ['rungd-ladder', 'rungd-controller', 'rungd-test'];

let client;

function settings() {
    const own = vscode.workspace.getConfiguration('rungd');
    return { live: own.get('live'), socket: own.get('socket') };
}

function makeClient() {
    const command = vscode.workspace.getConfiguration('rungd').get('path') || 'rungd';
    const server = { command, args: ['lsp'] };
    const options = {
        documentSelector: LANGUAGES.map((language) => ({ scheme: 'file', language })),
        initializationOptions: settings,
        synchronize: {
            configurationSection: 'rungd',
            fileEvents: vscode.workspace.createFileSystemWatcher('**/*.toml'),
        },
    };
    return new LanguageClient('rungd', 'rungd', server, options);
}

// `rungd.path` belongs to the machine where rungd runs: in a remote window it is no setting of the
// user, and the search among those finds nothing.
function showPathSetting() {
    const [command, query] = vscode.env.remoteName
        ? ['workbench.action.openRemoteSettings', { query: 'rungd.path' }]
        : ['workbench.action.openSettings', 'rungd.path'];
    vscode.commands.executeCommand(command, query);
}

async function start() {
    const starting = makeClient();
    client = starting;
    try {
        await starting.start();
    } catch (failure) {
        // The client fails with a text if the program is not there, else with an error.
        const reason = failure?.message ?? failure;
        const text = `rungd: the language server does not start: ${reason}`;
        const choice = await vscode.window.showErrorMessage(text, 'Set rungd.path');
        if (choice) {
            showPathSetting();
        }
    }
}

async function stop() {
    const stopping = client;
    client = undefined;
    // A server that never started cannot be stopped.
    if (stopping) await stopping.stop().catch(() => {});
}

async function restart() {
    await stop();
    await start();
}

// Gives a TOML file of rungd its language, which opens it again; one that is no file of rungd is
// TOML. The server starts with the first file of rungd: who edits only other TOML needs none.
async function recognize(document) {
    const { languageId, uri } = document;
    if (uri.scheme !== 'file' || !(languageId === 'toml' || LANGUAGES.includes(languageId))) {
        return;
    }
    const language = languageOf(uri.path, document.getText());
    if (language && language !== languageId) {
        await vscode.languages.setTextDocumentLanguage(document, language);
    } else if (LANGUAGES.includes(languageId) && !client) {
        await start();
    }
}

// A command of the server, with the active file and the cursor, for the palette.
function here(command, withCursor) {
    return () => {
        const editor = vscode.window.activeTextEditor;
        if (!editor) return undefined;
        const given = [editor.document.uri.toString()];
        const { line, character } = editor.selection.active;
        if (withCursor) given.push({ line, character });
        return vscode.commands.executeCommand(command, ...given);
    };
}

async function activate(context) {
    const on = vscode.commands.registerCommand;
    context.subscriptions.push(
        vscode.workspace.onDidOpenTextDocument(recognize),
        vscode.workspace.onDidSaveTextDocument(recognize),
        vscode.workspace.onDidChangeConfiguration((change) => {
            if (client && change.affectsConfiguration('rungd.path')) restart();
        }),
        on('rungd.restart', restart),
        on('rungd.here.test', here('rungd.test', false)),
        on('rungd.here.simulate', here('rungd.simulate', false)),
        on('rungd.here.survey', here('rungd.survey', false)),
        on('rungd.here.explain', here('rungd.explain', true)),
        on('rungd.here.why', here('rungd.why', true)),
    );
    await Promise.all(vscode.workspace.textDocuments.map(recognize));
}

module.exports = { activate, deactivate: stop };
