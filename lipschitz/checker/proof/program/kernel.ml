(* A certificate as a Coq file that coqc accepts by computation in its kernel: `swarmcert-check-proved --coq`. *)

(* Coq reads long numbers twice as fast in hexadecimal. *)
let long out z = Buffer.add_string out (if Z.numbits z < 10 then Z.to_string z else Z.format "%#x" z)
let long_number out (m, e) = Printf.bprintf out "(%a,%s)" long m (Z.to_string e)
let number out (m, e) = Printf.bprintf out "(%s,%s)" (Z.to_string m) (Z.to_string e)
let integer out z = Buffer.add_string out (Z.to_string z)
let natural out n = Printf.bprintf out "%d%%nat" n
let flag out b = Buffer.add_string out (if b then "true" else "false")
let list element out elements =
  Buffer.add_char out '[';
  List.iteri (fun k e -> if k > 0 then Buffer.add_string out ";"; element out e) elements;
  Buffer.add_char out ']'
let numbers = list number
let long_numbers = list long_number
let matrix = list long_numbers
let pair first second out (a, b) = Printf.bprintf out "(%a,%a)" first a second b

let layer = pair matrix long_numbers
let rec activation_words = function
  | Proved.Relu -> "Relu" | Tanh -> "Tanh" | Sigmoid -> "Sigmoid" | Softplus -> "Softplus" | Elu -> "Elu"
  | Selu -> "Selu" | Silu -> "Silu" | Gelu -> "Gelu" | Sorted Halves -> "(Sorted Halves)"
  | Sorted Pairs -> "(Sorted Pairs)" | Sorted (Groups k) -> Printf.sprintf "(Sorted (Groups %d))" k
  | Keeping (n, a) -> Printf.sprintf "(Keeping %d%%nat %s)" n (activation_words a)
let activation out a = Buffer.add_string out (activation_words a)
let part out { Proved.hidden; outer; clamp; between } =
  Printf.bprintf out "Part %a %a %a %a" (list layer) hidden layer outer (list (pair number number)) clamp
    (list activation) between
let func out = function
  | Proved.Alone p -> Printf.bprintf out "(Alone %a)" natural p
  | Set_of (phi, rho) -> Printf.bprintf out "(Set_of %a %a)" natural phi natural rho
let compositions = list (list natural)
let box = list (pair number number)
let term out { Proved.phi; inputs_in; fewest; most } =
  Printf.bprintf out "(Term %a %a (%a) (%a))" natural phi box inputs_in integer fewest integer most
let claim out = function
  | Proved.Norm_at_most (p, k, u) -> Printf.bprintf out "Norm_at_most %a %a %a" natural p natural k number u
  | Norm_at_least (p, k, l) -> Printf.bprintf out "Norm_at_least %a %a %a" natural p natural k number l
  | Slope_at_most (f, moves, scale, u) ->
    Printf.bprintf out "Slope_at_most %a %a %a %a" func f (list flag) moves numbers scale number u
  | Slope_at_least (silent, f, moves, scale, l) ->
    Printf.bprintf out "Slope_at_least %a %a %a %a %a" compositions silent func f (list flag) moves numbers scale
      number l
  | Law (stacked, kinds, rho, u) ->
    Printf.bprintf out "Law %a %a %a %a" flag stacked (list (pair (pair natural (list flag)) integer)) kinds natural rho
      number u
  | Slope_in_box _ | Slope_among _ | Law_in_box _ | Law_among _ ->
    assert false  (* not written: Claims.prove_unwritten *)
  | Within (p, b, v) -> Printf.bprintf out "Within %a %a %a" natural p box b box v
  | Sum_within (silent, terms, rho, v) ->
    Printf.bprintf out "Sum_within %a %a %a %a" compositions silent (list term) terms natural rho box v
  | Step_at_most (silent, boxes, phi, rho, u) ->
    Printf.bprintf out "Step_at_most %a %a %a %a %a" compositions silent (list (pair natural box)) boxes natural phi
      natural rho number u
  | Jump_at_most (phi, b, rho, u) ->
    Printf.bprintf out "Jump_at_most %a %a %a %a" natural phi box b natural rho number u
  | Float_error (in_order, p, b, r, e, u) ->
    Printf.bprintf out "Float_error %a %a %a %a %a %a" flag in_order natural p box b numbers r numbers e number u
  | Sum_float_error (in_order, terms, rho, u) ->
    Printf.bprintf out "Sum_float_error %a %a %a %a" flag in_order (list (pair term numbers)) terms natural rho number u
let proof out = function
  | Proved.By_inequality (rho, t, { unit0; scales; rows }) ->
    Printf.bprintf out "By_inequality %a %a (Factor (%a) %a %a)" number rho long_numbers t integer unit0
      (list integer) scales (list (list long)) rows
  | By_vector v -> Printf.bprintf out "By_vector %a" numbers v
  | By_product -> Buffer.add_string out "By_product"
  | By_points (x, y, others) ->
    Printf.bprintf out "By_points %a %a %a" numbers x numbers y (list (pair natural numbers)) others
  | By_triangle -> Buffer.add_string out "By_triangle"
  | By_parts _ | By_all_parts _ | By_parts_among _ | By_local_product | By_local_inequality _ | By_halves _ ->
    assert false  (* not written *)
  | By_layers bounds -> Printf.bprintf out "By_layers %a" (list box) bounds
  | By_sum sums -> Printf.bprintf out "By_sum %a" box sums
  | By_norm -> Buffer.add_string out "By_norm"
  | By_roundings (bounds, errors, moved, offs, made) ->
    Printf.bprintf out "By_roundings %a %a %a %a %a" (list box) bounds (list numbers) errors number moved numbers offs
      number made
  | By_steps sums -> Printf.bprintf out "By_steps %a" (list box) sums
  | By_rounded_sum (sums, errors) -> Printf.bprintf out "By_rounded_sum %a %a" box sums numbers errors

let file parts claims =
  let out = Buffer.create (1 lsl 20) in
  Buffer.add_string out
    "(* coqc -R THEORY Swarmcert FILE.v , THEORY: the folder of the compiled theory.\n\
    \   `certificate` is what is claimed of `networks`; Meaning.v says what that means. *)\n\
     From Coq Require Import List ZArith.\nFrom Swarmcert Require Import Activations Checker Meaning Claims Sound.\n\
     Import ListNotations.\nOpen Scope Z_scope.\n\n";
  List.iteri (fun k p -> Printf.bprintf out "Definition network%d : part := %a.\n" k part p) parts;
  Printf.bprintf out "Definition networks : list part := [%s].\n\n"
    (String.concat "; " (List.mapi (fun k _ -> Printf.sprintf "network%d" k) parts));
  List.iteri (fun k (c, p) ->
      Printf.bprintf out "Definition claim%d : claim := %a.\nDefinition proof%d : proof := %a.\n"
        k claim c k proof p) claims;
  Printf.bprintf out "\nDefinition certificate : list (claim * proof) := [%s].\n"
    (String.concat "; " (List.mapi (fun k _ -> Printf.sprintf "(claim%d, proof%d)" k k) claims));
  Buffer.add_string out
    "Theorem accepted : check_all networks [] certificate = true.\nProof. vm_cast_no_check (eq_refl true). Qed.\n\
     Theorem certificate_holds : Forall (fun c => holds networks (fst c)) certificate.\n\
     Proof. exact (check_all_holds _ _ accepted). Qed.\nPrint Assumptions certificate_holds.\n";
  Buffer.contents out
