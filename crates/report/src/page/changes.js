const edge = document.getElementById("edge");
if (edge) {
  const later = document.getElementById("later");
  const cut = document.querySelector("#cut rect");
  const line = document.getElementById("edge-line");
  const [x, width] = ["x", "width"].map((name) => Number(later.getAttribute(name)));
  const put = () => {
    const at = x + (width * Number(edge.value)) / 100;
    cut.setAttribute("x", at);
    line.setAttribute("transform", `translate(${at} 0)`);
  };
  edge.addEventListener("input", put);
  put();
  const layer = (box, shown) => {
    const input = document.getElementById(box);
    const show = () => document.getElementById(shown).setAttribute("visibility", input.checked ? "visible" : "hidden");
    input.addEventListener("change", show);
    show();
  };
  layer("show-difference", "difference");
  layer("show-blocks", "blocks");
}
