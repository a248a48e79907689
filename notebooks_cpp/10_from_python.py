# %% [markdown]
# # 10 From Python
#
# How large does the Lipschitz constant become while I train, and which physics does a model lack? Without leaving
# Python:
#
#     |f(x) - f(y)| <= L |x - y|        (certify: L is proved for exactly these weights, whatever the optimiser did)
#
# `swarmcert` runs the commands of the tool in process: same numbers, no files, no output.

# %%
import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

import swarmcert

pd.set_option("display.width", 100)

# %% [markdown]
# ## Certify in a training loop
#
# A network 2 -> 16 -> 16 -> 1 learns a downwash: the force on a vehicle over the lateral distance and the height of
# another one. Plain numpy; a `state_dict` or an `nn.Sequential` of PyTorch is passed to `certify` in the same way.

# %%
random = np.random.default_rng(1)
sizes = [2, 16, 16, 1]
net = {}
for k, (a, b) in enumerate(zip(sizes, sizes[1:]), start=1):
    net[f"fc{k}.weight"] = random.normal(size=(b, a)) * np.sqrt(2 / a)
    net[f"fc{k}.bias"] = np.zeros(b)


def truth(x):
    """Gram-force, over lateral distance [m] and height [m]."""
    return -10 * np.exp(-((x[:, 0] / 0.15) ** 2) - ((x[:, 1] - 0.4) / 0.2) ** 2)


def forward(x):
    values = [x]
    for k in (1, 2, 3):
        y = values[-1] @ net[f"fc{k}.weight"].T + net[f"fc{k}.bias"]
        values.append(np.maximum(y, 0) if k < 3 else y)
    return values


def step(x, target, rate, limit):
    """One step down the gradient of the mean square; then every spectral norm back to `limit`."""
    values = forward(x)
    error = (values[-1][:, 0] - target)[:, None]
    gradient = 2 * error / len(x)
    for k in (3, 2, 1):
        weight, bias = net[f"fc{k}.weight"], net[f"fc{k}.bias"]
        below = gradient @ weight
        weight -= rate * gradient.T @ values[k - 1]
        bias -= rate * gradient.sum(axis=0)
        if k > 1:
            gradient = below * (values[k - 1] > 0)
        norm = np.linalg.norm(weight, 2)
        weight *= min(1, limit / norm)
    return float(np.sqrt(np.mean(error**2)))


def draw(n):
    return np.column_stack([random.uniform(-0.5, 0.5, n), random.uniform(0, 1, n)])


history = []
for epoch in range(12):
    for _ in range(150):
        x = draw(256)
        rmse = step(x, truth(x), rate=0.02, limit=6.0)
    found = swarmcert.certify(net, nodes=4)  # milliseconds; Ctrl-C works, progress=... reports
    history.append({"epoch": epoch, "rmse_gf": rmse, "proved": found.upper(), "found": found.bounds[0]["lower"]})
print(pd.DataFrame(history).iloc[[0, 5, 11]].round(1).to_string(index=False))

# %%
table = pd.DataFrame(history)
figure, left = plt.subplots(figsize=(6, 3))
left.fill_between(table.epoch, table.found, table.proved, color="#0072b2", alpha=0.3, label="between found and proved")
left.set(xlabel="epoch", ylabel="Lipschitz constant [gf/m]", ylim=(0, None))
right = left.twinx()
right.plot(table.epoch, table.rmse_gf, color="#d55e00", label="error")
right.set(ylabel="RMSE [gf]", ylim=(0, None))
figure.legend(loc="upper center", ncol=2)
plt.show()

# %% [markdown]
# The certificate is a text. It names the weights by their hash, and the independent checker accepts it for them only.

# %%
print(swarmcert.check(found, net).reason)
net["fc1.bias"][0] += 1e-9
print(swarmcert.check(found, net).accepted)

# %% [markdown]
# What cannot be certified raises an error that says what to do.

# %%
try:
    swarmcert.certify({**net, "fc2.weight": net["fc2.weight"].astype(int)})
except swarmcert.InputError as error:
    print(error.field, "|", error.value, "|", error.what)

# %% [markdown]
# ## Read a log
#
# The simulator writes five flights of two vehicles; the truth has motor lag, downwash, drag and ground effect.

# %%
truth_model = "stability/models/crazyflie-small-effects.toml"
model = "stability/models/crazyflie-small.toml"
gains = "controller/gains/crazyflie-small.toml"
for seed in range(1, 6):
    swarmcert.simulate(
        "random-walk", f"flights/{seed}", vehicles=2, duration=20, model=truth_model, gains=gains, seed=seed
    )
log = swarmcert.read("flights/1/cf1_00")
print(log.format, "|", ", ".join(log))
print(log["position_m"].shape, log.units["position_m"])
print([(s.name, s.source) for s in log.sources if s.source != "measured"])

# %% [markdown]
# ## Where does a model fail, and what is missing?
#
# `compare` returns what `--json` writes; its lists go into pandas. Forces are in newton.

# %%
compared = swarmcert.compare(model, "flights")
regions = pd.DataFrame(compared.table("regions"))
regions["bias_mN"] = 1000 * regions["bias.z"]
print(regions[["words", "share", "bias_mN"]].head(3).round(2).to_string(index=False))

# %% [markdown]
# `residuals` gives the arrays behind the plots: here the vertical residual over the time of one vehicle.

# %%
track = swarmcert.residuals(model, "flights/1")[0]
figure, axes = plt.subplots(figsize=(6, 2.5))
axes.plot(track.time_s[track.used], 1000 * track.residual_N[track.used, 2], color="#0072b2", linewidth=0.7)
axes.set(xlabel="time [s]", ylabel="vertical residual [mN]")
plt.show()

# %% [markdown]
# `study` finds what is missing, adds it, and shows the error on flights that nothing was fitted to; its page is
# `study/study.html`.

# %%
study = swarmcert.study(model, "flights", "study")
ladder = pd.DataFrame(study.table("ladder"))
for column in ("fit_rmse", "select_rmse", "test_rmse"):
    ladder[column] *= 1000
print(ladder[ladder.accepted][["effect", "fit_rmse", "select_rmse", "test_rmse"]].round(1).to_string(index=False))
