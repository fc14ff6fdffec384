// Tests of the extension, in plain node: `node test.js RUNGD [BUNDLE]`. RUNGD is the program, and
// BUNDLE is what package.sh makes of extension.js. VS Code itself is not needed.
'use strict';

const tests = {
    ...require('./test/files'),
    ...require('./test/snippets'),
    ...require('./test/extension'),
};

(async () => {
    for (const [name, test] of Object.entries(tests)) {
        await test();
        console.log(`ok: ${name}`);
    }
})().catch((failure) => {
    console.error(failure);
    process.exit(1);
});
