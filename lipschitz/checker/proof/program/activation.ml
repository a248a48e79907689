(* What lies between the layers of a network, by the name that chains give it. *)

(* Name, words, meaning. *)
let all =
  [ "relu", "ReLU", Proved.Relu; "tanh", "tanh", Tanh; "sigmoid", "sigmoid", Sigmoid; "softplus", "softplus", Softplus;
    "elu", "ELU", Elu; "selu", "SELU", Selu; "silu", "SiLU", Silu; "gelu", "GELU", Gelu ]

let called op = Option.map (fun (_, _, a) -> a) (List.find_opt (fun (name, _, _) -> name = op) all)
let entry activation = List.find (fun (_, _, a) -> a = activation) all
let name activation = let name, _, _ = entry activation in name
let words activation = let _, words, _ = entry activation in words
