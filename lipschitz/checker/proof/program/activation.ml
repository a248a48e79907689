(* What lies between the layers of a network, by the name that chains give it. *)

(* Name, words, meaning. *)
let all =
  [ "relu", "ReLU", Proved.Relu; "tanh", "tanh", Tanh; "sigmoid", "sigmoid", Sigmoid; "softplus", "softplus", Softplus;
    "elu", "ELU", Elu; "selu", "SELU", Selu; "silu", "SiLU", Silu; "gelu", "GELU", Gelu;
    "maxmin:halves", "MaxMin of halves", Sorted Halves; "maxmin:pairs", "MaxMin of pairs", Sorted Pairs ]

let sizes = List.init 63 (( + ) 2)
let group_sort k = "groupsort:" ^ string_of_int k
let called op = match List.find_opt (fun (name, _, _) -> name = op) all with
  | Some (_, _, a) -> Some a
  | None -> Option.map (fun k -> Proved.Sorted (Groups k)) (List.find_opt (fun k -> group_sort k = op) sizes)
let rec entry = function
  | Proved.Sorted (Groups k) as activation -> group_sort k, "GroupSort of " ^ string_of_int k, activation
  | Keeping (n, changed) as activation ->
    let name, words, _ = entry changed in
    Printf.sprintf "%s:%d" name n, Printf.sprintf "%s of the first %d" words n, activation
  | activation -> List.find (fun (_, _, a) -> a = activation) all
let name activation = let name, _, _ = entry activation in name
let words activation = let _, words, _ = entry activation in words
let sorts activation = not (Proved.changes_numbers activation)
let keeps = function Proved.Keeping _ -> true | _ -> false
(* The width of a hidden layer is a multiple of it. *)
let group = function Proved.Sorted (Groups k) -> k | Sorted (Halves | Pairs) -> 2 | _ -> 1
(* How many multipliers a matrix inequality has for a layer: one for each number, or two for each group. *)
let multipliers activation outputs =
  if sorts activation then 2 * (outputs / group activation) else outputs
