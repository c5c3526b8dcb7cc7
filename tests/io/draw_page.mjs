// SPDX-License-Identifier: GPL-3.0-or-later
// node draw_page.mjs index.html: what the script of the page of `radiosity compare` draws, in a browser of a few lines.
import { readFileSync } from 'node:fs';
import { runInNewContext } from 'node:vm';

const escaped = (value) => String(value).replace(/[&<"]/g, (c) => ({ '&': '&amp;', '<': '&lt;', '"': '&quot;' })[c]);

class Element {
  constructor(name) {
    Object.assign(this, { name, attributes: '', children: [] });
  }
  setAttribute(key, value) {
    this.attributes += ` ${key}="${escaped(value)}"`;
  }
  append(...children) {
    this.children.push(...children);
  }
  toString() {
    const inner = this.children.map((child) => (child instanceof Element ? child : escaped(child)));
    return `<${this.name}${this.attributes}>${inner.join('')}</${this.name}>\n`;
  }
}

const page = readFileSync(process.argv[2], 'utf8');
const script = (attributes) => page.split(`<script${attributes}>`)[1].split('</script>')[0];
const document = {
  body: new Element('body'),
  createElementNS: (space, name) => new Element(name),
  getElementById: (id) => ({ textContent: script(` type="application/json" id="${id}"`) }),
};
runInNewContext(script(''), { document });
console.log(`${document.title}\n${document.body}`);
