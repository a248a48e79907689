(* Ranges, jumps and float32 errors over a box, as claims of the theorems: of each network by its layers, then of their
   sum. *)

open Refusal
open Json

let texts where ~size json =
  let values = List.map (fun word -> Exact.of_float (Exact.parse_hex_float word)) (Exact.words (text where json)) in
  require (List.length values = size) "%s: needs one number per output" where;
  values

(* What is stated of a layer or a sum: intervals, and errors by whether sums are in order ([] where nothing is said of
   float32). *)
let stated where ~size ~with_error json =
  require_keys where [ "lower"; "upper"; "error"; "error_in_order" ] json;
  let lower = texts where ~size (find where "lower" json) in
  let upper = texts where ~size (find where "upper" json) in
  let error key =
    let error = find where key json in
    require ((error <> Null) = with_error) "%s: an error must be given if there are input errors, and only then" where;
    if with_error then texts where ~size error else [] in
  let in_any = error "error" in
  let in_order = error "error_in_order" in
  List.combine lower upper, fun ordered -> if ordered then in_order else in_any

(* The layers of a network in order; the last one by itself. *)
let layers where (weights : Weights.t) ~with_error json =
  let entries = list where json in
  require (List.length entries = List.length weights.layers) "%s: needs one entry per layer" where;
  let of_layer layer entry = stated where ~size:(Weights.outputs layer) ~with_error entry in
  let all = List.map2 of_layer weights.layers entries in
  match List.rev all with last :: hidden -> List.rev hidden, last | [] -> assert false

let leaves where = where ^ ": the values leave the bounds"
let too_little where = where ^ ": claims less than the float32 error"

(* At least the square root, on the grid of swarmcert check. *)
let root_above x =
  let units, exponent = Proved.ceil_to (Z.of_int (-320)) x in
  let shift = Z.to_int exponent + 320 in
  Z.succ (Z.sqrt (Z.shift_left units shift)), Z.of_int (-160)

(* The norms of what the layers add to the errors of their inputs. *)
let added (state : Claims.t) where p ~in_order ~box ~errors bounds stated_errors =
  let part = Proved.part_at state.parts p in
  let layers = Proved.layers part in
  let norms = match Proved.list_norms state.accepted p 0 layers with
    | Some norms -> norms | None -> rejected "%s: norms are missing" where in
  let rec go off box errors layers norms bounds stated_errors = match layers, norms with
    | (w, biases) :: layers, norm :: norms ->
      let rounding = Proved.layer_roundings in_order w biases (Proved.widened box errors) (Proved.sizes box errors) in
      (match rounding with
       | None -> rejected "%s" (too_little where)
       | Some made ->
         let off = Claims.plus (Claims.times norm off) (root_above (Proved.squareD made)) in
         off :: (match bounds, stated_errors with
             | b :: bounds, e :: stated_errors ->
               go off (List.map Proved.relu_ends b) e layers norms bounds stated_errors
             | _ -> []))
    | _ -> [] in
  go Exact.zero (Proved.clamp_ends part.clamp box) errors layers norms bounds stated_errors

(* Of a network for inputs in `box`, computed with errors of at most `errors`, entry by entry. `norm`: of its error, by
   whether the sums are in order. *)
let prove_network (state : Claims.t) where p ~box ~errors ~with_error ~norm (hidden, (last, last_error)) =
  let bounds = List.map fst hidden in
  Claims.prove state (Within (p, box, last)) (By_layers bounds) (leaves where);
  let prove in_order =
    let errors = errors in_order and stated_errors = List.map (fun (_, error) -> error in_order) hidden in
    match List.rev (added state where p ~in_order ~box ~errors bounds stated_errors) with
    | made :: offs ->
      Claims.prove state (Float_error (in_order, p, box, errors, last_error in_order, norm in_order))
        (By_roundings (bounds, stated_errors, root_above (Proved.squareD errors), List.rev offs, made))
        (too_little where)
    | [] -> assert false in
  if with_error then List.iter prove [ false; true ]

(* At least the norm of these numbers. *)
let sum_of numbers = List.fold_left Claims.plus Exact.zero numbers

(* What reaches the first layer: a box, and errors. The theorems apply the clamp themselves. *)
let input_box (state : Claims.t) where name entry =
  let box = match find where "domain" entry with
    | Text "box" -> Witness.box where state.json name
    | Text "clamp" when state.net.clamp <> [] && Network.is_clamped name -> state.net.clamp
    | _ -> rejected "%s: the domain is neither the box nor a clamp of this input" where in
  List.map (fun (low, high) -> Exact.of_float low, Exact.of_float high) box
let input (state : Claims.t) where name entry =
  let box = input_box state where name entry in
  match find where "input_error" entry with
  | Null -> box, fun _ -> []
  | all ->
    let errors = Exact.hex_floats where (find where name all) in
    require (List.length errors = List.length box && List.for_all (fun e -> e >= 0.) errors)
      "%s: needs one input error per input, none negative" where;
    let errors = List.map Exact.of_float errors in
    box, fun _ -> errors

let optional where entry key ~given =
  let decimal = find where key entry and hex = find where (key ^ "_hex") entry in
  require ((decimal <> Null) = given && (hex <> Null) = given)
    "%s: %s must be given where it has a meaning, and only there" where key;
  if given then Some (Exact.of_float (Exact.number (where ^ " " ^ key) decimal hex)) else None

let keys = [ "function"; "neighbours"; "domain"; "input_error"; "networks"; "sum"; "lower"; "upper"; "jump"; "jump_hex";
             "float32_error"; "float32_error_hex"; "float32_error_in_order"; "float32_error_in_order_hex" ]

(* Of the largest absolute values. *)
let sum_of_squares values =
  sum_of (List.map (fun i -> let a = Proved.largest_abs i in Claims.times a a) values)

let check_jump (state : Claims.t) where phi ~box ~values rho jump =
  let reason = where ^ ": claims less than the jump" in
  let slope = match Hashtbl.find_opt state.uppers (rho, "all", []) with
    | Some (slope, Claims.Proved_here) -> slope
    | _ -> rejected "%s: rests on a bound of %s that is missing" where (shown rho) in
  require (Claims.at_most (Claims.times (Claims.times slope slope) (sum_of_squares values)) (Claims.times jump jump))
    "%s" reason;
  Claims.prove state (Jump_at_most (phi, box, Functions.index state.net rho, jump)) Proved.By_norm reason

(* Exact intervals of the layers of part p over a box, proved; those of the last one. *)
let prove_exact (state : Claims.t) where p box =
  let part = Proved.part_at state.parts p in
  let through (found, box, between) layer =
    let bounds = Proved.affine_ends layer box in
    let activation, behind = match between with a :: rest -> a, rest | [] -> Proved.Relu, [] in
    bounds :: found, Proved.activated_ends activation bounds, behind in
  let hidden, input, _ =
    List.fold_left through ([], Proved.clamp_ends part.clamp box, part.between) part.hidden in
  let last = Proved.affine_ends part.outer input in
  Claims.prove state (Within (p, box, last)) (By_layers (List.rev hidden)) (leaves where);
  last

(* One neighbour that makes or ends a composition in which the function is silent: the values beside those. *)
let check_step (state : Claims.t) where entry ~silent phi rho jump =
  let names = Array.of_list (List.map fst state.net.parts) in
  let compositions = Proved.beside silent phi in
  let here = List.sort_uniq compare (phi :: List.concat compositions) in
  let boxes = List.map (fun p -> p, input_box state where names.(p) entry) here in
  List.iter (fun (p, box) -> ignore (prove_exact state where p box)) boxes;
  let size = Proved.inputs_of (Proved.part_at state.parts rho) in
  let sum_of composition =
    match Option.bind (Proved.terms_of boxes composition) (Proved.sum_ends state.accepted size) with
    | Some sum -> sum | None -> rejected "%s: no range of a term" where in
  let sums = List.map sum_of compositions in
  let reason = where ^ ": claims less than the step to neighbours for which the network is silent" in
  List.iter (fun sum ->
      let values = prove_exact state where rho sum in
      let square = sum_of_squares values in
      require (Claims.at_most square (Claims.times jump jump)) "%s" reason) sums;
  Claims.prove state (Step_at_most (silent, boxes, phi, rho, jump)) (Proved.By_steps sums) reason

let check (state : Claims.t) entry =
  require_keys "values" keys entry;
  let f = text "values" (find "values" "function" entry) in
  let where = "values of " ^ shown f and names = Functions.networks_of f in
  let is_set = List.length names = 2 in
  require (if is_set then List.hd names <> "phi:ground" else f = "network")
    "%s: possible only for the network, or for a sum over neighbours" where;
  let count = match find where "neighbours" entry with
    | Number { value; is_integer = true } when Float.abs value <= 1e15 -> int_of_float value
    | _ -> rejected "%s: neighbours is not an integer" where in
  require (if is_set then 1 <= count && count <= Claims.most_neighbours else count = 0)
    "%s: impossible number of neighbours" where;
  let inputs = List.hd names :: if is_set && Functions.has_ground state.net then [ "phi:ground" ] else [] in
  let rho = List.tl names in
  let weights name = Functions.weights state.net name in
  let networks = find where "networks" entry in
  require (List.length (members where networks) = List.length (inputs @ rho))
    "%s: networks does not list the networks of the function" where;
  let with_error = find where "input_error" entry <> Null in
  if with_error then begin
    require (List.length (members where (find where "input_error" entry)) = List.length inputs)
      "%s: input_error is not of the function's inputs" where;
    require (List.for_all (fun name -> (weights name).precision = "float32") (inputs @ rho))
      "%s: a float32 error of weights that are not float32" where;
    require (List.for_all (Functions.is_relu state.net) (inputs @ rho))
      "%s: a float32 error of a network with activations other than ReLU" where
  end;
  let bounds name = layers (where ^ ": " ^ name) (weights name) ~with_error (find where name networks) in
  let numbers key = List.map Exact.of_float (Exact.hex_floats where (find where key entry)) in
  let lower = numbers "lower" and upper = numbers "upper" in
  let outer = weights (List.nth names (List.length names - 1)) in
  let outputs = Weights.outputs (Weights.last_layer outer) in
  require (List.length lower = outputs && List.length upper = outputs) "%s: the values leave the range" where;
  let range = List.combine lower upper in
  let jump = optional where entry "jump" ~given:is_set in
  let norm_of key = Option.value ~default:Exact.zero (optional where entry key ~given:with_error) in
  let in_any = norm_of "float32_error" in
  let in_order = norm_of "float32_error_in_order" in
  let norm ordered = if ordered then in_order else in_any in
  let sum = find where "sum" entry in
  require ((sum <> Null) = is_set) "%s: a sum must be given for set functions, and only for them" where;
  (match rho with
   | [] ->
     let p = Functions.index state.net f in
     let box, errors = input state where f entry in
     let hidden, (last, last_error) = bounds f in
     prove_network state where p ~box ~errors ~with_error ~norm (hidden, (last, last_error));
     (* The range may be wider than what is stated of the last layer. *)
     Claims.prove state (Within (p, box, range)) (By_layers (List.map fst hidden))
       (where ^ ": the values leave the range");
     require (Proved.contains range last) "%s: the values leave the range" where
   | rho :: _ ->
     let term name =
       let p = Functions.index state.net name in
       let box, errors = input state where name entry in
       let hidden, (last, last_error) = bounds name in
       prove_network state (where ^ ": " ^ name) p ~box ~errors ~with_error
         ~norm:(fun ordered -> sum_of (last_error ordered))
         (hidden, (last, last_error));
       let fewest, most = if name = "phi:ground" then 1, 1 else 0, count in
       { Proved.phi = p; inputs_in = box; fewest = Z.of_int fewest; most = Z.of_int most }, errors, last in
     let terms = List.map term inputs in
     let r = Functions.index state.net rho in
     let size = Functions.inputs state.net rho in
     let sums, sum_errors = stated (where ^ ": sum") ~size ~with_error sum in
     let last = bounds rho in
     prove_network state (where ^ ": " ^ rho) r ~box:sums ~errors:sum_errors ~with_error ~norm last;
     let silent = Functions.silent state.net rho and summed = List.map (fun (t, _, _) -> t) terms in
     let zeros = List.map (fun _ -> Exact.zero, Exact.zero) range in
     require (not (Proved.may_be_silent silent summed) || Proved.contains range zeros)
       "%s: the range lacks 0, the output for neighbours for which the network is silent" where;
     Claims.prove state (Sum_within (silent, summed, r, range)) (Proved.By_sum sums)
       (where ^ ": the values leave the range");
     let first, _, values = List.hd terms in
     let jump = Option.get jump in
     check_jump state where first.phi ~box:first.inputs_in ~values rho jump;
     if silent <> [] then check_step state where entry ~silent first.phi r jump;
     let prove_sum in_order =
       let terms = List.map (fun (t, errors, _) -> t, errors in_order) terms in
       Claims.prove state (Sum_float_error (in_order, terms, r, norm in_order))
         (Proved.By_rounded_sum (sums, sum_errors in_order)) (too_little where) in
     if with_error then List.iter prove_sum [ false; true ]);
  state.values <- state.values + 1
