// How ESLint 10 judges the JavaScript of the repository: `.ci/run format`, from the top folder.
const fs = require('fs');
const path = require('path');
const js = require('@eslint/js');
const globals = require('globals');

const SOURCES = 'host/src';

/** What the scripts of the report's page declare for each other: the page has them in one script. */
function namesOfThePage() {
  const scripts = fs.readdirSync(SOURCES, { recursive: true }).filter((name) => name.endsWith('.js'));
  const declared = scripts.flatMap((name) => {
    const text = fs.readFileSync(path.join(SOURCES, name), 'utf8');
    return [...text.matchAll(/^(?:const|let|class|(?:async )?function\*?) (\w+)/gm)].map((match) => match[1]);
  });
  return Object.fromEntries(declared.map((name) => [name, 'readonly']));
}

const rules = {
  'array-callback-return': 'error',
  complexity: ['error', 16],
  eqeqeq: 'error',
  'no-use-before-define': ['error', { functions: false }],
  'no-var': 'error',
  'object-shorthand': 'error',
  'prefer-const': 'error',
};

module.exports = [
  js.configs.recommended,
  {
    files: ['tests/outside/**/*.js'],
    languageOptions: { sourceType: 'commonjs', globals: { ...globals.node, ...globals.browser } },
    rules: { ...rules, 'max-len': ['error', { code: 110 }], 'no-shadow': 'error' },
  },
  {
    files: [`${SOURCES}/**/*.js`],
    languageOptions: { sourceType: 'script', globals: { ...globals.browser, ...namesOfThePage() } },
    // A name of another script is not used before it is declared, and one that others use is used.
    rules: {
      ...rules,
      'no-redeclare': ['error', { builtinGlobals: false }],
      'no-unused-vars': ['error', { vars: 'local' }],
      'no-use-before-define': 'off',
    },
  },
];
