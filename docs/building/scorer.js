// How the search of the site ranks pages: first the page whose row in words.toml has the typed word, then users' pages.
// The weights are those of Sphinx (searchtools.js); `score` adds the page's own factor.
/** What is typed in the letters of the index: indices and powers as plain digits, ⁄ as /. */
var folded = (typed) => typed.normalize("NFKC").replaceAll("⁄", "/");
// in the place of Sphinx's own
var splitQuery = (query) => folded(query).split(/[^\p{Letter}\p{Number}_\p{Emoji_Presentation}]+/gu).filter((term) => term);
/** The stems of a text. */
var stemsOf = (text) => splitQuery(text.toLowerCase()).map((word) => new Stemmer().stemWord(word));
/** How well an entry of the index answers what is typed: 1 where it is the whole, less where it is a part. */
var share = (entry, typed) => (stemsOf(entry).every((stem) => typed.includes(stem)) ? stemsOf(entry).length / typed.length : 0);
// the site has no categories
Documentation.addTranslations({messages: {
  "Your search did not match any documents. Please make sure that all words are spelled correctly and that you've selected enough categories.":
  "No page has these words. Try others, in English or German, or look into “Glossary”, “Messages” and “Commands” in the menu."}});
/** Where no page has all of the words: the pages with some of them, or with words of the index in a compound. */
var withAll = Search.performTermsSearch;
Search.performTermsSearch = (words, excluded) => {
  const pages = {};
  const found = withAll(words, excluded);
  if (found.length) return found;
  const inside = (entry) => entry.length > 4 && [...words].some((word) => word.includes(entry));
  const parts = Object.keys(Search._index.indexentries).filter(inside).flatMap(stemsOf);
  for (const result of [...words, ...parts].flatMap((word) => withAll(new Set([word]), excluded))) {
    pages[result[0]] = result.with(4, result[4] + (pages[result[0]]?.[4] ?? 0));
  }
  return Object.values(pages);
};
var Scorer = {
  score: ([page, title, anchor, description, score, file]) => {
    const asked = folded(new URLSearchParams(location.search).get("q") || "").trim();
    const typed = asked.toLowerCase();
    // a name of the reference that is typed whole, as of a function or a command; of one word, of a class or of lmfit
    const ends = ["." + typed, "> " + typed].some((end) => `.${title.toLowerCase()}`.endsWith(end));
    if (ends && anchor && page.startsWith("reference/")) {
      if (/[_. ]|[a-z][A-Z]/.test(asked)) return 2000 + score;
      if (/^[A-Z]/.test(asked) ? title.endsWith("." + asked) : title.includes(".FittedModel.")) return 50 + score;
    }
    const {docnames, indexentries} = Search._index;
    const entries = Object.keys(indexentries).filter((entry) => indexentries[entry].some(([file, , main]) => main && docnames[file] === page));
    const best = Math.max(0, ...entries.map((entry) => share(entry, stemsOf(asked))));
    if (best) score += best === 1 ? 1000 : 50 * best;
    const words = (text) => text.toLowerCase().replace(/[^\p{Letter}\p{Number}]+/gu, " ");
    if (typed && !anchor && !page.startsWith("decisions/") && words(title).includes(words(typed))) score += 100;
    if (/^(decisions\/|reference\/|speed$|mutants$|fuzzing$|contributing$|changes$)/.test(page)) return 0.2 * score;
    if (/^(reproduce$)/.test(page)) return 0.4 * score;
    if (/^(data|install|bench|experiments\/|messages|report|notebook)/.test(page)) return 1.5 * score;
    return score;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
