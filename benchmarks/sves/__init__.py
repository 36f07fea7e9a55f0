"""Stein Variational Ergodic Search (Lee, Lerch, Ramos, Abraham; RSS 2024), figure by figure.

    python -m benchmarks.sves                            all of them (some minutes)
    python -m benchmarks.sves.figure_03_determinant      one

Each prints what the paper claims beside what is found here, and draws it under `figures/`. The claims are those of the
paper's abstract and of this project's notes on it (the full captions were not at hand: figures go by their subject);
where a setting is not known, the script says what it takes. What the recipe as printed does is shown beside what it
does once corrected, and beside the product's own solver.

| figure | what it shows here                                                         |
|--------|----------------------------------------------------------------------------|
| 2      | several coverage strategies between the same two points                    |
| 3      | diversity over the steps: det K of the Stein set against independent descent|
| 4      | the same in a forest of obstacles                                          |
| 5      | coverage of a cube                                                         |
| 6      | receding horizon: the information moves, the flight follows                |
| 9      | kernels compared: RBF, Markov RBF, signature, identity, constant           |
| 10     | time of a step over the number of candidates                               |
| 11     | time of a step over horizon and dimension                                  |
| 12     | an aircraft around a sphere, two modes of information                      |
"""
