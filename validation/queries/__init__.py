"""Questions that people ask of a mesh: inside, distance, all hits; judged exactly, with other libraries beside ours."""
