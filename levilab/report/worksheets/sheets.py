"""The experiments that have a worksheet; nothing heavy is imported, so that a wrong name is refused at once."""

from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Sheet:
    """An experiment's worksheet.

    Attributes:
        experiment, analysis: their names.
        settings: of the experiment, as one types them: a class has an hour.
        asked: quantities of the key beside those that a class compares.
        clicks: what is said of the bench in the browser, in the texts of all worksheets.
    """

    experiment: str
    analysis: str
    settings: tuple[str, ...] = ()
    asked: tuple[str, ...] = ()
    clicks: str = "with_clicks"

    def commands(self, group: str, seed: int, spoken: str = "") -> tuple[str, ...]:
        """Return what a group types.  spoken: the option of the language, after a blank."""
        chosen = "".join(f" --set {one}" for one in self.settings)
        return (
            f'levilab acquire {self.experiment} --mock --group "{group}" --seed {seed}{spoken} --out class{chosen}',
            f"levilab analyze {self.analysis} class{spoken}",
            f"levilab report class -o report.html{spoken}",
        )


#: Number of tops of the worksheet on limits.
TOPS = 10
SHEETS = MappingProxyType({
    sheet.experiment: sheet
    for sheet in (
        Sheet("spin", "spindown"),
        Sheet("limit", "limit", (f"limit.repetitions={TOPS}",), ("scatter",), clicks="without_clicks"),
        Sheet("field", "field", asked=("mass_to_set", "lightest_mass", "heaviest_mass")),
        Sheet("precession", "precession"),
    )
})  # fmt: skip
