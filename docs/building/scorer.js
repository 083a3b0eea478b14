// How the search of the site ranks pages: that of the typed word first, users' pages before those of developers.
// The weights are those of Sphinx (searchtools.js); `score` adds the page's own factor.
/** Words as they are typed → as the pages have them. */
var typedAs = {wifi: "wi-fi", wlan: "wi-fi", karman: "kármán", photodiode: "phototransistor", download: "install",
  license: "licence", luftwiderstand: "reibung", photogate: "phototransistor", webcam: "camera",
  // German words that no page has
  lichtschranke: "phototransistor", mikrofon: "microphone", soundkarte: "sound card", handy: "phone",
  gewicht: "weight", einheit: "unit", komma: "comma", unterlegscheiben: "washers", magnetfeld: "field",
  messunsicherheit: "uncertainty", fehlermeldung: "error", arbeitsblatt: "worksheet", lehrer: "teacher",
  oszilloskop: "oscilloscope", zähler: "counter", auswertung: "analyze"};
/** What is typed in the letters of the index: indices and powers as plain digits, ⁄ as /. */
var folded = (typed) => typed.normalize("NFKC").replaceAll("⁄", "/").replace(/\p{Letter}+/gu, (word) => typedAs[word.toLowerCase()] ?? word);
// in the place of Sphinx's own
var splitQuery = (query) => folded(query).split(/[^\p{Letter}\p{Number}_\p{Emoji_Presentation}]+/gu).filter((term) => term);
var Scorer = {
  // page → the words for which it is the first
  pages: {
    "open-my-file": ["excel", "spreadsheet", "xlsx", "csv", "labview", "arduino", "audio", "wav", "mp3", "comma", "decimal comma", "rpm", "drehzahl", "unit",
      "units", "wrong unit"],
    "class": ["students", "student", "teacher", "worksheet", "grading", "seed"],
    "sound-card": ["microphone", "sound card", "speaker"],
    "glossary": ["lock", "locked", "c3/2", "c32", "uncertainty", "aicc", "undecided", "gate"],
    "phone": ["smartphone", "phyphox", "wi-fi"], "physics": ["von kármán", "kármán"], "notebook": ["jupyter", "python"], "messages": ["warning", "warnings", "error"],
    "live": ["share", "qr code", "language"], "index": ["licence"], "install": ["windows", "mac"], "simulator": ["simulate"], "practise": ["virtual bench"],
    "report": ["pdf", "budget", "uncertainty budget"], "tutorial": ["tutorial"], "video": ["film", "video", "camera"], "animation": ["animation"],
    "instruments/oscilloscope": ["oscilloscope"], "instruments/counter": ["counter"], "experiments/washers": ["washers", "weight", "mass"], "experiments/spin": ["tape", "lamp", "spindown"],
    "experiments/triggered": ["hold"], "experiments/trace": ["phototransistor"],
  },
  score: ([page, title, anchor, description, score, file]) => {
    const asked = folded(new URLSearchParams(location.search).get("q") || "").trim();
    const typed = asked.toLowerCase();
    // a name of the reference that is typed whole, as of a function or a command; of one word, of a class or of lmfit
    const ends = ["." + typed, "> " + typed].some((end) => `.${title.toLowerCase()}`.endsWith(end));
    if (ends && anchor && page.startsWith("reference/")) {
      if (/[_. ]|[a-z][A-Z]/.test(asked)) return 2000 + score;
      if (/^[A-Z]/.test(asked) ? title.endsWith("." + asked) : title.includes(".FittedModel.")) return 50 + score;
    }
    if (Scorer.pages[page]?.includes(typed)) return 1000 + score;
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
