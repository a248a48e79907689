(* Names: functions of NET, blocks of their inputs, units, and the chain of operations that a network is. *)

open Refusal

let starts_with prefix text = String.starts_with ~prefix text
let ends_with suffix text = String.ends_with ~suffix text

let networks_of f =
  if f = "network" || starts_with "phi:" f || starts_with "rho:" f then [ f ]
  else match String.index_from_opt f (min 4 (String.length f)) ':' with
    | Some colon when starts_with "set:" f ->
      [ "phi:" ^ String.sub f 4 (colon - 4); "rho:" ^ String.sub f (colon + 1) (String.length f - colon - 1) ]
    | _ -> rejected "networks_of: no function is called \"%s\"" (shown f)

let weights (net : Network.t) part = match List.assoc_opt part net.parts with
  | Some w -> w | None -> rejected "there is no network %s" (shown part)
let index (net : Network.t) part =
  let rec go k = function [] -> rejected "there is no network %s" (shown part) | (name, _) :: rest ->
      if name = part then k else go (k + 1) rest in
  go 0 net.parts
let is_relu net part = Weights.is_relu (weights net part)
let inputs net part = Weights.inputs (Weights.first_layer (weights net part))
let has_ground (net : Network.t) = List.mem_assoc "phi:ground" net.parts

let ground_names = [ "minus_z_m"; "minus_v_x_m_s"; "minus_v_y_m_s"; "minus_v_z_m_s" ]
let six_names = [ "dp_x_m"; "dp_y_m"; "dp_z_m"; "dv_x_m_s"; "dv_y_m_s"; "dv_z_m_s" ]
let input_names (net : Network.t) part =
  if part = "phi:ground" then ground_names
  else if starts_with "rho:" part then []
  else if net.order <> [] then net.order
  else if inputs net part = 6 then six_names else []

(* Which inputs of the moved network belong to the block. *)
let moves net f block =
  let part = List.hd (networks_of f) in
  let names = input_names net part in
  let is_in k =
    let name = Option.value ~default:"" (List.nth_opt names k) in
    block = "all" || block = "x" ^ string_of_int k
    || (block = "position" && ends_with "_m" name) || (block = "velocity" && ends_with "_m_s" name) in
  let result = List.init (inputs net part) is_in in
  require (List.mem true result) "block_coordinates: %s has no block \"%s\"" (shown f) (shown block);
  result

let unit (net : Network.t) f block =
  let part = List.hd (networks_of f) in
  let names = if net.order = [] then [] else input_names net part in
  let names = if block = "all" || names = [] then names
    else List.concat (List.mapi (fun k moved -> if moved then [ List.nth names k ] else []) (moves net f block)) in
  let all suffix = List.for_all (ends_with suffix) names in
  let input = if names = [] then "input" else if all "_m_s" then "(m/s)" else if all "_m" then "m" else "(m, m/s)" in
  let output = if net.unit = "" then "output" else net.unit in
  if starts_with "phi:" f then "hidden/" ^ input else if starts_with "rho:" f then
      output ^ "/hidden" else output ^ "/" ^ input

type operation = { op : string; layer : string option; from : int; onto : int; words : string }
let chain (net : Network.t) part =
  let w = weights net part in
  let n = inputs net part in
  let clamp = if net.clamp <> [] && Network.is_clamped part then 
      [ { op = "clamp"; layer = None; from = n; onto = n; words = "clamp" } ] else [] in
  let linear (l : Weights.layer) =
    { op = "linear"; layer = Some l.name; from = Weights.inputs l; onto = Weights.outputs l;
      words = if l.name = "" then "linear" else l.name } in
  let activated a (l : Weights.layer) =  (* in front of l *)
    [ { op = Activation.name a; layer = None; from = Weights.inputs l; onto = Weights.inputs l;
        words = Activation.words a }; linear l ] in
  clamp @ linear (List.hd w.layers) :: List.concat (List.map2 activated (Weights.between w) (List.tl w.layers))

let chain_words steps = String.concat " - " (List.map (fun step -> step.words) steps)
let silent_names (net : Network.t) = List.map (fun (own, kinds) -> String.concat "+" kinds ^ ">" ^ own) net.silent
(* Parts that have the same words, together. *)
let words (net : Network.t) =
  let add found (name, _) =
    let words = chain_words (chain net name) in
    if List.mem_assoc words found then List.map
        (fun (w, names) -> w, if w = words then names ^ ", " ^ name else names) found
    else found @ [ words, name ] in
  match net.parts with
  | [ "network", _ ] -> chain_words (chain net "network")
  | parts -> String.concat "; " (List.map (fun (w, names) -> names ^ ": " ^ w) (List.fold_left add [] parts))
    ^ String.concat "" (List.map (( ^ ) "; silent: ") (silent_names net))

(* The networks as the theorems speak of them. *)
let part (net : Network.t) (name, (w : Weights.t)) =
  let row numbers = List.map Exact.of_float (Array.to_list numbers) in
  let layer (l : Weights.layer) = List.map row (Array.to_list l.weights), row l.biases in
  let layers = List.map layer w.layers in
  let rec cut = function [ last ] -> [], last | l :: ls -> let h, last = cut ls in l :: h, last | [] -> assert false in
  let hidden, outer = cut layers in
  let clamp = if Network.is_clamped name then List.map (fun (a, b) -> Exact.of_float a, Exact.of_float b) net.clamp
      else [] in
  { Proved.hidden; outer; clamp; between = Weights.between w }
let parts (net : Network.t) = List.map (part net) net.parts
(* The compositions in which rho, by name, is silent: of each the numbers of the networks whose terms make up the
   sum. *)
let silent (net : Network.t) rho =
  let terms (own, kinds) =
    if "rho:" ^ own <> rho then None
    else
      let ground = if has_ground net then [ "phi:ground" ] else [] in
      Some (List.map (index net) (List.map (( ^ ) "phi:") kinds @ ground)) in
  List.filter_map terms net.silent
