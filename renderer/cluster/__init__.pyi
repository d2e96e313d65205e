from ..checkpoints.study import Study as Study
from .clients import connected as connected
from .pictures import frames_on as frames_on
from .pictures import render_on as render_on
from .rays import any_hit as any_hit
from .rays import closest_hit as closest_hit
from .studies import run_on as run_on
from .view_factors import view_factors_on as view_factors_on
