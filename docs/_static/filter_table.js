// Adds a field above each table of the class "filtered"; rows without the typed words are hidden.
document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll("table.filtered")) {
    const field = document.createElement("input");
    field.type = "search";
    field.placeholder = "Filter the rows, for example: depth";
    field.className = "filter";
    table.before(field);
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/);
      for (const row of table.tBodies[0].rows) {
        const text = row.textContent.toLowerCase();
        row.hidden = !words.every((word) => text.includes(word));
      }
    });
  }
});
