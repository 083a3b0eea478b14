// How the search of the site ranks pages: that of the typed word first, users' pages before those of developers.
// The weights are those of Sphinx (searchtools.js); `score` adds the page's own factor.
var Scorer = {
  // words that people type → the page for them
  pages: {
    excel: "open-my-file", spreadsheet: "open-my-file", xlsx: "open-my-file", csv: "open-my-file",
    labview: "open-my-file", arduino: "open-my-file", audio: "open-my-file", smartphone: "phone", phyphox: "phone",
    microphone: "sound-card", "sound card": "sound-card", jupyter: "notebook", python: "notebook", grading: "class",
    students: "class", worksheet: "class", windows: "install", oscilloscope: "instruments/oscilloscope", washers: "experiments/washers",
    pdf: "report", tutorial: "tutorial", wav: "open-my-file", mp3: "open-my-file", film: "video", animation: "animation",
    lock: "glossary", locked: "glossary",
  },
  score: ([page, title, anchor, description, score, file]) => {
    const asked = (new URLSearchParams(location.search).get("q") || "").trim();
    const typed = asked.toLowerCase();
    if (Scorer.pages[typed] === page) return 1000 + score;
    // a name of the reference that is typed whole, as of a function or a command
    const ends = ["." + typed, "> " + typed].some((end) => `.${title.toLowerCase()}`.endsWith(end));
    if (ends && anchor && page.startsWith("reference/") && /[_. ]|[a-z][A-Z]/.test(asked)) return 500 + score;
    if (typed && !anchor && title.toLowerCase().includes(typed)) score += 100;
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
