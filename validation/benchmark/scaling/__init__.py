"""What more workers than two would do: arithmetic and a simulation, both from what ``measures.cluster`` measured."""
