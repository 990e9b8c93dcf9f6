"""A recorded session as tables of pandas: session_table.py SESSION.xdf"""
import sys

import merkel
import pandas as pd

if len(sys.argv) != 2:
    sys.exit(__doc__)
session = merkel.load(sys.argv[1])
spikes = pd.DataFrame(session.spikes)
afferents = pd.DataFrame(session.afferents).set_index("neuron")
table = afferents.assign(spikes=spikes.groupby("neuron").size()).fillna({"spikes": 0})
print(table.sort_values("spikes", ascending=False).head(10))
