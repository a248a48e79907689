(** Bounds and laws for states of which phi sees rotation invariants: the map to these is Lipschitz with 3/2, or 1. *)
From Coq Require Import List ZArith Reals Lra Lia Psatz Bool.
From Swarmcert Require Import Algebra Activations Form Network Checker Meaning Steepness Sets Distance Blocks Lower
    Values Enclosures Intervals Claims Slopes Laws Ranges.
Import ListNotations.
Open Scope R_scope.

Lemma length_of_square a b : length_of a b * length_of a b = a * a + b * b.
Proof. apply sqrt_sqrt. nra. Qed.
Lemma length_of_product a b c d : a * c + b * d <= length_of a b * length_of c d.
Proof.
  unfold length_of. rewrite <- sqrt_mult_alt by nra. pose proof (sqrt_pos ((a * a + b * b) * (c * c + d * d))).
  destruct (Rle_dec 0 (a * c + b * d)) as [P|N]; [|lra]. apply sqrt_above; auto.
  pose proof (Rle_0_sqr (a * d - b * c)) as Q. unfold Rsqr in Q. lra.
Qed.
(** A length changes by at most the length of the change. *)
Lemma length_of_contracts a b c d :
  (length_of a b - length_of c d) * (length_of a b - length_of c d) <= (a - c) * (a - c) + (b - d) * (b - d).
Proof.
  pose proof (length_of_square a b). pose proof (length_of_square c d). pose proof (length_of_product a b c d). lra.
Qed.
Theorem invariants_contract o x y : length x = observed_numbers o -> length y = observed_numbers o ->
  let c := real (slope_of_invariants o) in
  square (minus (invariants o x) (invariants o y)) <= c * c * square (minus x y).
Proof.
  destruct o; cbn [observed_numbers slope_of_invariants].
  - destruct x as [|a1 [|a2 [|a3 [|a4 [|a5 [|a6 [|]]]]]]]; try discriminate.
    destruct y as [|b1 [|b2 [|b3 [|b4 [|b5 [|b6 [|]]]]]]]; try discriminate. intros _ _.
    assert (real (3, -1)%Z = 3 / 2) as E by (rewrite real_below; change (Pos.to_nat 1) with 1%nat; lra).
    cbv zeta. rewrite E. unfold square, minus. cbn [invariants scale map plus dot].
    pose proof (length_of_contracts a1 a2 b1 b2). pose proof (length_of_contracts a4 a5 b4 b5).
    pose proof (length_of_contracts (a1 + a4 / 2) (a2 + a5 / 2) (b1 + b4 / 2) (b2 + b5 / 2)).
    (* (a + b / 2)^2 <= 5/4 (a^2 + b^2) *)
    pose proof (Rle_0_sqr ((a1 - b1) - 2 * (a4 - b4))) as P. pose proof (Rle_0_sqr ((a2 - b2) - 2 * (a5 - b5))) as Q.
    pose proof (Rle_0_sqr ((a1 - b1) / 2 - (a4 - b4))) as S. pose proof (Rle_0_sqr ((a2 - b2) / 2 - (a5 - b5))) as T.
    unfold Rsqr in *. lra.
  - destruct x as [|a1 [|a2 [|a3 [|a4 [|]]]]]; try discriminate.
    destruct y as [|b1 [|b2 [|b3 [|b4 [|]]]]]; try discriminate. intros _ _.
    cbv zeta. rewrite real_one. unfold square, minus. cbn [invariants scale map plus dot].
    pose proof (length_of_contracts a2 a3 b2 b3). lra.
Qed.
Lemma length_invariants o x : length x = observed_numbers o -> length (invariants o x) = number_of_invariants o.
Proof.
  destruct o; cbn [observed_numbers].
  - destruct x as [|a1 [|a2 [|a3 [|a4 [|a5 [|a6 [|]]]]]]]; try discriminate. reflexivity.
  - destruct x as [|a1 [|a2 [|a3 [|a4 [|]]]]]; try discriminate. reflexivity.
Qed.

(** One of them *)
Lemma square_in_alike c n d : real c <> 0 -> length d = n -> square_in (repeat c n) d = square d / (real c * real c).
Proof.
  intros C <-. unfold square. induction d as [|a d IH]; simpl; [field; auto|]. rewrite IH. field. auto.
Qed.
Lemma agree_all n x y : length x = n -> length y = n -> agree (repeat true n) x y.
Proof.
  revert x y. induction n as [|n IH]; intros [|a x] [|b y]; simpl; try discriminate; auto.
Qed.
Lemma find_scaled_sound ps accepted phi rho scale u : Forall (holds ps) accepted ->
  find_scaled accepted phi rho scale = Some u ->
  holds ps (Slope_at_most (Set_of phi rho) (repeat true (length scale)) scale u).
Proof.
  intros H. induction H as [|c rest Hc H IH]; [discriminate|].
  destruct c as [| |[|q k] m s v| | | | | | | | | | | | | |]; simpl find_scaled; auto.
  destruct (Nat.eqb_spec phi q), (Nat.eqb_spec rho k); cbn [andb]; auto.
  destruct (same_moves m _) eqn:E; cbn [andb]; auto. destruct (same_numbers s scale) eqn:F; auto.
  apply same_moves_eq in E. apply same_numbers_eq in F. intros G. inversion G. now subst.
Qed.
Lemma slope_of_invariants_positive o : 0 < real (slope_of_invariants o).
Proof. destruct o; apply real_positive; reflexivity. Qed.
Lemma slope_of_states_sound ps accepted o phi rho u : Forall (holds ps) accepted ->
  check_slope_of_states ps accepted o phi rho u = true -> holds ps (Slope_of_states o phi rho u).
Proof.
  intros HA. unfold check_slope_of_states. set (n := number_of_invariants o). set (c := slope_of_invariants o).
  intros H. both H. apply Nat.eqb_eq in H. destruct (find_scaled accepted phi rho (repeat c n)) as [w|] eqn:E;
    [|discriminate]. both H0. apply real_nonnegative in H0. apply at_most_real in H1.
  apply (find_scaled_sound ps) in E; auto. rewrite repeat_length in E. intros rest x y X Y f.
  pose proof (length_invariants o x X) as Lx. pose proof (length_invariants o y Y) as Ly. fold n in Lx, Ly.
  pose proof (E rest _ _ (agree_all n _ _ Lx Ly) ltac:(cbn [moved]; congruence)) as B.
  pose proof (slope_of_invariants_positive o) as P. fold c in P.
  assert (distance (repeat c n) (invariants o x) (invariants o y) <= norm (minus x y)) as D.
  { unfold distance, norm. apply sqrt_le_1_alt. rewrite square_in_alike by (rewrite ?length_minus; lra || congruence).
    pose proof (invariants_contract o x y X Y) as K. cbv zeta in K. fold c in K.
    apply divided; [nra|lra]. }
  pose proof (norm_nonneg (minus x y)). unfold f. eapply Rle_trans; [exact B|].
  apply Rle_trans with (real w * norm (minus x y)); [now apply Rmult_le_compat_l|now apply Rmult_le_compat_r].
Qed.

(** Several of them *)
Lemma find_of_states_sound ps accepted o phi rho u : Forall (holds ps) accepted ->
  find_of_states accepted o phi rho = Some u -> holds ps (Slope_of_states o phi rho u).
Proof.
  intros H. revert u. induction H as [|c rest Hc H IH]; intros u; [discriminate|].
  destruct c as [| | | | | | | | | | | | | | |a q k v|]; simpl find_of_states; auto.
  assert (same_observed o a = true -> o = a) as S by (destruct o, a; simpl; congruence).
  destruct (same_observed o a); cbn [andb]; [|apply IH]. specialize (S eq_refl). subst a.
  destruct (Nat.eqb_spec phi q), (Nat.eqb_spec rho k); cbn [andb]; try apply IH. subst.
  unfold less_of. destruct (find_of_states rest o q k) as [w|]; [destruct (at_most w v)|];
    intros G; inversion G; subst; first [exact Hc | now apply IH].
Qed.
(** As kinds whose moves are counted only. *)
Definition as_kind (k : kind_of_states) : kind := (snd (fst k), [], snd k).
Definition bounds_of_states (ps : list part) (rho : nat) (cs : list dyadic) (kinds : list kind_of_states) :=
  Forall2 (fun c (k : kind_of_states) => holds ps (Slope_of_states (fst (fst k)) (snd (fst k)) rho c)) cs kinds.
Lemma total_of_states_sound ps accepted squares kinds rho v : Forall (holds ps) accepted ->
  total_of_states accepted squares kinds rho = Some v -> exists cs,
  not_negative cs (map as_kind kinds) /\ bounds_of_states ps rho cs kinds /\
  real v = fold_right Rplus 0 (map
      (fun ck : dyadic * kind => IZR (snd (snd ck)) * (if squares then
      real (fst ck) * real (fst ck) else real (fst ck))) (combine cs (map as_kind kinds))).
Proof.
  intros HA. revert v. induction kinds as [|[[o phi] n] kinds IH]; intros v; simpl.
  - intros H. inversion H. exists []. split; [constructor|]. split; [constructor|]. apply real_zero.
  - destruct (find_of_states accepted o phi rho) as [k|] eqn:Hk; [|discriminate].
    destruct (total_of_states accepted squares kinds rho) as [w|] eqn:Hw; [|discriminate].
    destruct (is_nonnegative k) eqn:Kn; [|discriminate]. destruct (Z.leb_spec 0 n); [|discriminate]. simpl.
    intros G. inversion G. destruct (IH w eq_refl) as (cs & P & B & E). exists (k :: cs). split; [|split].
    + constructor; auto. simpl. split; auto. now apply real_nonnegative.
    + constructor; auto. now apply (find_of_states_sound ps accepted).
    + rewrite real_add, real_mul, E. simpl. f_equal. replace (real (n, 0%Z)) with (IZR n) by (unfold real; simpl; ring).
      destruct squares; auto. now rewrite real_mul.
Qed.
Fixpoint steps_of_states (ps : list part) (cs : list dyadic) (groups : list (kind_of_states * list mover)) :
    list moving :=
  match cs, groups with
  | c :: cs', g :: groups' =>
      let v side m := value (part_at ps (snd (fst (fst g)))) (invariants (fst (fst (fst g))) (side m)) in
      map (fun m => Moving (real c) (v fst m) (v snd m) (step_of m)) (snd g) ++ steps_of_states ps cs' groups'
  | _, _ => []
  end.
Lemma states_steps ps cs kinds movers :
  let steps := steps_of_states ps cs (combine kinds movers) in
  let others := steps_of ps cs (combine (map as_kind kinds) movers) in
  map bound steps = map bound others /\ map far steps = map far others.
Proof.
  cbv zeta. revert cs movers. induction kinds as [|k kinds IH]; intros [|c cs] [|ms movers]; simpl; auto.
  destruct (IH cs movers) as [Eb Ef]. rewrite !map_app, !map_map, Eb, Ef. auto.
Qed.
Lemma states_values ps cs kinds movers : length cs = length kinds ->
  let steps := steps_of_states ps cs (combine kinds movers) in
  flat_map (terms_of_states ps fst) (combine kinds movers) = map before steps /\
  flat_map (terms_of_states ps snd) (combine kinds movers) = map after steps.
Proof.
  cbv zeta. revert cs movers. induction kinds as [|k kinds IH]; intros [|c cs] [|ms movers]; simpl;
    try discriminate; auto.
  intros H. destruct (IH cs movers ltac:(lia)) as [-> ->]. rewrite !map_app, !map_map. auto.
Qed.
Lemma states_hold ps rho cs kinds movers : bounds_of_states ps rho cs kinds -> Forall2 states_may_move kinds movers ->
  Forall (fun m => forall s,
      norm (minus (value (part_at ps rho) (plusR (before m) s)) (value (part_at ps rho) (plusR (after m) s)))
    <= bound m * far m) (steps_of_states ps cs (combine kinds movers)).
Proof.
  intros H. revert movers. induction H as [|c k cs kinds Hk H IH]; intros movers M; [constructor|].
  inversion M as [|? ms ? movers' [_ Hms] M']; subst. simpl.
  apply Forall_app. split; auto. apply Forall_map, Forall_forall. intros m Hm s. simpl.
  rewrite Forall_forall in Hms. destruct (Hms m Hm) as [L L']. exact (Hk s (fst m) (snd m) L L').
Qed.
Lemma law_of_states_sound ps accepted stacked kinds rho u : Forall (holds ps) accepted ->
  check_law_of_states ps accepted stacked kinds rho u = true -> holds ps (Law_of_states stacked kinds rho u).
Proof.
  intros HA. unfold check_law_of_states. intros H. do 2 both H. rename H0 into Ht, H1 into Hf.
  apply real_nonnegative in H.
  destruct (total_of_states accepted stacked kinds rho) as [v|] eqn:Ev; [|discriminate]. apply at_most_real in Ht.
  destruct (total_of_states_sound _ _ _ _ _ _ HA Ev) as (cs & P & B & E). intros movers M sum. unfold sum.
  destruct (states_values ps cs kinds movers (Forall2_lengths _ _ _ B)) as [-> ->].
  apply law_of_sums with (cs := cs) (v := v) (ps := ps) (kinds := map as_kind kinds); auto.
  - clear - M. induction M as [|k ms kinds movers [N _] M IH]; constructor; auto.
  - destruct (states_steps ps cs kinds movers) as [<- <-]. apply telescope_all; auto. now apply states_hold.
Qed.
