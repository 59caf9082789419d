// What is folded opens on paper, and for a link that leads into it.
window.addEventListener("beforeprint", function () {
  document.querySelectorAll("details").forEach(function (d) { d.open = true; });
});
function unfold() {
  var place = location.hash && document.getElementById(location.hash.slice(1)), d = place && place.closest("details");
  if (d && !d.open) { d.open = true; place.scrollIntoView(); }
}
window.addEventListener("hashchange", unfold);
unfold();
