// How the search of the site ranks pages: those of users before those of developers and the reference.
// The weights are those of Sphinx (searchtools.js); `score` adds the page's own factor.
var Scorer = {
  score: ([page, title, anchor, description, score, file]) => {
    if (/^(decisions\/|reference\/|speed$|mutants$|fuzzing$|contributing$|changes$)/.test(page)) return 0.2 * score;
    if (/^(reproduce$|sweeps-at-scale$)/.test(page)) return 0.4 * score;
    if (/^(data|install|bench|experiments\/|report|notebook)/.test(page)) return 1.5 * score;
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
