"""Why pixels of our picture differ from Mitsuba's: both trees of rays, walked side by side to where they part."""
