# SPDX-License-Identifier: Apache-2.0
"""See a light field in the browser: a page that refocuses it on the GPU.

`light_field_page`, `live_page`, `focused_page` and `pictures_page` make what the page shows;
`server.serve` shows it on this machine, `export` puts it into one file. The page itself is in
``assets``: plain JavaScript without libraries.
"""

from plenofir.view.export import export
from plenofir.view.focused import focused_page
from plenofir.view.light_field import light_field_page, live_page
from plenofir.view.live import Live, film_file_frames, folder_frames, video_frames
from plenofir.view.page import Page
from plenofir.view.picture_folder import pictures_page

__all__ = [
    "Live",
    "Page",
    "export",
    "film_file_frames",
    "focused_page",
    "folder_frames",
    "light_field_page",
    "live_page",
    "pictures_page",
    "video_frames",
]
