// What eslint demands of the page's modules.

const browser = ["document", "globalThis", "DOMParser", "CSS", "EventSource", "fetch", "requestAnimationFrame",
  "setTimeout", "clearTimeout", "URL", "process", "IntersectionObserver", "ResizeObserver"];
const raw = ["innerHTML", "outerHTML", "insertAdjacentHTML", "write"];

export default [
  {
    languageOptions: {
      ecmaVersion: 2022, sourceType: "module", globals: Object.fromEntries(browser.map((name) => [name, "readonly"])),
    },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      "no-unused-vars": "error",
      "no-undef": "error",
      "no-var": "error",
      "prefer-const": "error",
      eqeqeq: "error",
      "no-eval": "error",
      "no-implied-eval": "error",
      "no-new-func": "error",
      "no-script-url": "error",
      "no-redeclare": "error",
      "no-use-before-define": ["error", { functions: false, variables: false }],
      "no-unreachable": "error",
      "no-dupe-keys": "error",
      "no-fallthrough": "error",
      "no-shadow-restricted-names": "error",
      "no-restricted-properties": ["error",
        ...raw.map((property) => ({ property, message: "Text becomes elements: use make()." }))],
      "max-lines": ["error", 400],
      "max-len": ["error", { code: 120, ignorePattern: "^import " }],
    },
  },
];
