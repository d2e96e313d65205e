"""All seeded defects."""

from validation.defects.seeded.defect import Defect
from validation.defects.seeded.factors import FACTORS
from validation.defects.seeded.hits import HITS
from validation.defects.seeded.lit import LIT
from validation.defects.seeded.looks import LOOKS
from validation.defects.seeded.pictures import PICTURES
from validation.defects.seeded.queries import QUERIES
from validation.defects.seeded.scenes import SCENES
from validation.defects.seeded.studies import STUDIES

DEFECTS: tuple[Defect, ...] = HITS + QUERIES + SCENES + STUDIES + FACTORS + LIT + PICTURES + LOOKS
