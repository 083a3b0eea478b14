// A button at each block copies it: of a block with prompts the commands alone, without the comments behind them.
function toCopy(text) {
  const commands = text.split("\n").filter((line) => line.startsWith("$ "));
  return commands.length ? commands.map((line) => line.slice(2).replace(/  +# .*/, "")).join("\n") : text.trimEnd();
}

document.addEventListener("DOMContentLoaded", () => {
  for (const pre of navigator.clipboard ? document.querySelectorAll(".highlight pre") : []) {
    const text = pre.textContent, button = document.createElement("button");
    button.className = "copy";
    button.textContent = "copy";
    button.onclick = () => navigator.clipboard.writeText(toCopy(text)).then(() => { button.textContent = "copied"; });
    pre.parentElement.append(button);
  }
});
